"""Rendering of pages and pictures: the templates, and the content security policy."""

from collections.abc import Callable
from datetime import datetime
from pathlib import Path

import vl_convert
from fastapi import Request, Response
from fastapi.templating import Jinja2Templates

from core.rounding import plain, significant, with_std
from core.units import quantity, shown, unit
from service.access.auth import login
from service.http.responses import Tagged
from service.jobs.schema import error_in_words
from service.reports.charts import Picture
from service.verdict import texts

SVG = "image/svg+xml"
UNKNOWN = "–"
"""In place of a value that is not known."""
FOLDER = Path(__file__).parent
TEMPLATES = Jinja2Templates(FOLDER / "templates")
POLICY = {
    "Content-Security-Policy": "default-src 'none'; img-src 'self'; style-src 'self'; script-src 'self'; "
    "connect-src 'self'; form-action 'self'; "
    "base-uri 'none'; frame-ancestors 'none'",
    "Cache-Control": "private, no-cache",
}


def page(request: Request, name: str, status: int = 200, **context: object) -> Response:
    """The page of a template, with a logout button for callers with a cookie."""
    context["logged_in"] = login(request) is not None
    return TEMPLATES.TemplateResponse(request, f"{name}.html", context, status, headers=POLICY)


def picture(draw: Callable[[], Picture], *identity: object) -> Tagged:
    """A chart as SVG; values that determine it are its identity."""
    return Tagged(lambda: vl_convert.vegalite_to_svg(draw().to_dict()).encode(), SVG, *identity)


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
