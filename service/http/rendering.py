"""Rendering of pages and charts: the templates, and the content security policy."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path as File
from typing import Annotated, Literal
from urllib.parse import urlencode
from zoneinfo import ZoneInfo

import orjson
from fastapi import Depends, Path, Request, Response
from fastapi.templating import Jinja2Templates
from jinja2 import pass_context
from jinja2.runtime import Context
from markupsafe import Markup

from core.rounding import plain, significant, with_std
from core.units import percent_in_table, quantity, shown, unit
from service.access.auth import caller, link, login
from service.access.roles import Role, soon_in_words
from service.documents import live, still
from service.documents.charts import DARK_STILLS, Picture, specification
from service.documents.translated import translated
from service.http.libraries import address as library_address
from service.http.responses import CSV, JSON, Tagged, is_known, tag
from service.jobs.schema import error_in_words
from service.language.templates import translate
from service.language.translation import said
from service.verdict import texts

SVG = "image/svg+xml"
CHANNEL_PARTS = 4
"""Network, station, location and channel."""
UNKNOWN = "–"
"""In place of a value that is not known."""
FOLDER = File(__file__).parent
TEMPLATES = Jinja2Templates(FOLDER / "templates")
POLICY = {
    "Content-Security-Policy": "default-src 'none'; img-src 'self'; style-src 'self'; script-src 'self'; "
    "connect-src 'self'; form-action 'self'; "
    "base-uri 'none'; frame-ancestors 'none'",
    "Cache-Control": "private, no-cache",
}


DARK_STILL = "<style>@media screen and (prefers-color-scheme: dark) {{{}}}</style>".format(
    "".join(
        f'[{part}="{light}"] {{ {part}: {dark} }} '
        for part in ("fill", "stroke")
        for light, dark in DARK_STILLS.items()
    )
)
SECRETIVE = {"Referrer-Policy": "no-referrer", "Cache-Control": "no-store"}
"""Headers of a page that shows a secret, or whose address contains one."""


def page(
    request: Request, name: str, status: int = 200, policy: Mapping[str, str] = POLICY, **context: object
) -> Response:
    """The page of a template, with a logout button for callers with a cookie, and a warning before their key ends.

    304 without it for a browser that has the page already.

    Args:
        request: the request.
        name: the template's.
        status: the answer's.
        policy: headers that restrict the browser.
        context: variables of the template; `zone` is the time zone of its times, UTC without it.
    """
    context.setdefault("zone", "UTC")
    context["logged_in"] = login(request) is not None or link(request) is not None
    acting = caller(request)
    context["may_make_keys"] = acting.role is Role.admin and acting.buildings is None
    context["key_ends"] = soon_in_words(acting.expires_at, datetime.now(UTC))
    response = TEMPLATES.TemplateResponse(request, f"{name}.html", context, status, headers=policy)
    if request.method == "GET" and status == 200:
        etag = tag(response.body)
        if is_known(request, etag):
            return Response(status_code=304, headers={**policy, "ETag": etag})
        response.headers["ETag"] = etag
    return response


@dataclass(frozen=True, slots=True)
class Form:
    """The requested form of a chart: still picture, specification of the live chart, numbers, or a page of these."""

    request: Request
    form: Annotated[Literal["svg", "json", "csv", "html"], Path()]


As = Annotated[Form, Depends()]


def picture(wanted: Form, draw: Callable[[], Picture], *identity: object) -> Response:
    """A chart in the requested form; `identity` determines its content."""
    return specified(wanted, lambda: specification(draw), *identity)


def specified(wanted: Form, specify: Callable[[], live.Spec], *identity: object) -> Response:
    """The chart of a specification of Vega-Lite in the requested form; `identity` determines its content."""
    match wanted.form:
        case "svg":
            return Tagged(lambda: _in_both_themes(still.svg(specify())).encode(), SVG, "both themes", *identity)
        case "json":
            return Tagged(lambda: orjson.dumps(translated(live.live(specify()))), JSON, "live", *identity)
        case "csv":
            return Tagged(lambda: live.as_csv(specify()), CSV, "numbers", *identity)
        case "html":
            spec, address = specify(), wanted.request.url
            own = f"{address.path.removesuffix('html')}{{}}?{address.query}".format
            return page(wanted.request, "chart", title=said(live.title(spec)), tables=live.tables(spec), own=own)


def _in_both_themes(svg: str) -> str:
    """A picture that follows the theme of the page: browsers apply the scheme of a page to its pictures."""
    return svg.replace(">", f">{DARK_STILL}", 1)


def moment(context: Context, at: datetime, zone: str | None = None) -> str:
    """A time to the second in a time zone, that of the page if none is given; for attributes and titles."""
    return f"{at.astimezone(ZoneInfo(zone or context['zone'])):%Y-%m-%d %H:%M:%S}"


def time(context: Context, at: datetime, zone: str | None = None) -> Markup:
    """The same with UTC on hover."""
    utc = at.astimezone(UTC)
    words = Markup('<time datetime="{:%Y-%m-%dT%H:%M:%SZ}" title="{:%Y-%m-%d %H:%M:%S} UTC">{}</time>')
    return words.format(utc, utc, moment(context, at, zone))


def percent(share: float | None) -> str:
    """A share in percent, to a tenth; a dash where it is not known."""
    return tenths(None if share is None else 100 * share)


def share_percent(share: float | None) -> str:
    """A share of the whole in percent, "< 0.1" where it rounds to nothing; a dash where it is not known."""
    return UNKNOWN if share is None else percent_in_table(share).removesuffix(" %")


def tenths(value: float | None) -> str:
    """A number to a tenth; a dash where it is not known."""
    return UNKNOWN if value is None else f"{value:.1f}"


def rounded(value: float | None) -> str:
    """A number to three digits; a dash where it is not known."""
    return UNKNOWN if value is None else significant(value)


def kilonewtons(force: float | None) -> str:
    """A force (N) in kN to three digits; a dash where it is not known."""
    return rounded(None if force is None else shown(force, "N"))


def query(fields: Mapping[str, object]) -> str:
    """The fields that are not empty, as the query of an address."""
    return urlencode({name: value for name, value in fields.items() if value not in ("", None)})


def fdsn_time(moment: datetime) -> str:
    """A time as FDSN services take it."""
    return f"{moment.astimezone(UTC):%Y-%m-%dT%H:%M:%S.%f}"


def stations(channels: Iterable[str]) -> list[tuple[str, str]]:
    """Networks and stations of channels, each once."""
    parts = (channel.split(".") for channel in channels)
    return sorted({(part[0], part[1]) for part in parts if len(part) == CHANNEL_PARTS})


translate(TEMPLATES.env)
TEMPLATES.env.globals |= {
    "library": library_address,
    "opening": texts.opening,
    "headline": texts.headline,
    "check_title": texts.title,
    "check_value": texts.value,
    "check_limit": texts.limit,
    "check_outcome": texts.outcome,
    "check_source": texts.source,
    "state_names": texts.STATE_NAMES,
    "meaning": texts.meaning,
    "inspected": texts.inspected,
    "results": texts.RESULTS,
}
TEMPLATES.env.filters |= {
    "words": error_in_words,
    "percent": percent,
    "share_percent": share_percent,
    "tenths": tenths,
    "rounded": rounded,
    "kilonewtons": kilonewtons,
    "moment": pass_context(moment),
    "time": pass_context(time),
    "fdsn_time": fdsn_time,
    "stations": stations,
    "with_std": with_std,
    "significant": significant,
    "plain": plain,
    "unit": unit,
    "shown": shown,
    "quantity": quantity,
    "query": query,
}
