"""Rendering of pages and charts: the templates, and the content security policy."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path as File
from typing import Annotated, Literal

import orjson
import vl_convert
from fastapi import Depends, Path, Request, Response
from fastapi.templating import Jinja2Templates

from core.rounding import plain, significant, with_std
from core.units import quantity, shown, unit
from service.access.auth import caller, login
from service.access.roles import soon_in_words
from service.http.libraries import address as library_address
from service.http.responses import CSV, JSON, Tagged
from service.jobs.schema import error_in_words
from service.reports import live
from service.reports.charts import Picture
from service.verdict import texts

SVG = "image/svg+xml"
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


def page(request: Request, name: str, status: int = 200, **context: object) -> Response:
    """The page of a template, with a logout button for callers with a cookie, and a warning before their key ends."""
    context["logged_in"] = login(request) is not None
    context["key_ends"] = soon_in_words(caller(request).expires_at, datetime.now(UTC))
    return TEMPLATES.TemplateResponse(request, f"{name}.html", context, status, headers=POLICY)


@dataclass(frozen=True, slots=True)
class Form:
    """The requested form of a chart: still picture, specification of the live chart, numbers, or a page of these."""

    request: Request
    form: Annotated[Literal["svg", "json", "csv", "html"], Path()]


As = Annotated[Form, Depends()]


def picture(wanted: Form, draw: Callable[[], Picture], *identity: object) -> Response:
    """A chart in the requested form; `identity` determines its content."""
    return specified(wanted, lambda: draw().to_dict(), *identity)


def specified(wanted: Form, specify: Callable[[], live.Spec], *identity: object) -> Response:
    """The chart of a specification of Vega-Lite in the requested form; `identity` determines its content."""
    match wanted.form:
        case "svg":
            return Tagged(lambda: vl_convert.vegalite_to_svg(specify()).encode(), SVG, *identity)
        case "json":
            return Tagged(lambda: orjson.dumps(live.live(specify())), JSON, "live", *identity)
        case "csv":
            return Tagged(lambda: live.as_csv(specify()), CSV, "numbers", *identity)
        case "html":
            spec, address = specify(), wanted.request.url
            own = f"{address.path.removesuffix('html')}{{}}?{address.query}".format
            return page(wanted.request, "chart", title=live.title(spec), tables=live.tables(spec), own=own)


def time(moment: datetime) -> str:
    """A time to the second."""
    return f"{moment:%Y-%m-%d %H:%M:%S}"


def percent(share: float | None) -> str:
    """A share in percent, to a tenth; a dash where it is not known."""
    return tenths(None if share is None else 100 * share)


def tenths(value: float | None) -> str:
    """A number to a tenth; a dash where it is not known."""
    return UNKNOWN if value is None else f"{value:.1f}"


def rounded(value: float | None) -> str:
    """A number to three digits; a dash where it is not known."""
    return UNKNOWN if value is None else significant(value)


def kilonewtons(force: float | None) -> str:
    """A force (N) in kN to three digits; a dash where it is not known."""
    return rounded(None if force is None else shown(force, "N"))


TEMPLATES.env.globals |= {
    "library": library_address,
    "opening": texts.opening,
    "headline": texts.headline,
    "check_title": texts.title,
    "check_value": texts.value,
    "check_limit": texts.limit,
    "check_source": texts.source,
    "state_names": texts.STATE_NAMES,
}
TEMPLATES.env.filters |= {
    "words": error_in_words,
    "percent": percent,
    "tenths": tenths,
    "rounded": rounded,
    "kilonewtons": kilonewtons,
    "time": time,
    "with_std": with_std,
    "significant": significant,
    "plain": plain,
    "unit": unit,
    "shown": shown,
    "quantity": quantity,
}
