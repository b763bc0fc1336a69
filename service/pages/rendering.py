"""How a page is written: its template, and what the browser may do with it."""

import math
from datetime import datetime
from pathlib import Path

from fastapi import Request, Response
from fastapi.templating import Jinja2Templates

from service.access.auth import COOKIE
from service.pages.units import shown, unit

FOLDER = Path(__file__).parent
TEMPLATES = Jinja2Templates(FOLDER / "templates")
POLICY = {
    "Content-Security-Policy": "default-src 'none'; img-src 'self'; style-src 'self'; form-action 'self'; "
    "base-uri 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",  # with no-referrer our own forms would come with 'Origin: null'
    "Cache-Control": "private, no-cache",
}


LARGE = 1e7
"""From which on a value and its standard deviation are written with a power of ten."""
RAISED = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")


def page(request: Request, name: str, status: int = 200, **context: object) -> Response:
    """The page of a template; whoever came with a cookie gets a button to log out."""
    context["logged_in"] = COOKIE in request.cookies
    return TEMPLATES.TemplateResponse(request, f"{name}.html", context, status, headers=POLICY)


def time(moment: datetime) -> str:
    """A time to the second."""
    return f"{moment:%Y-%m-%d %H:%M:%S}"


def with_std(value: float, std: float) -> str:
    """A value and its standard deviation, both to the latter's first digit; a value alone where that is 0."""
    if std == 0:
        return f"{value:.4g}"
    if abs(value) >= LARGE:
        power = math.floor(math.log10(abs(value)))
        return f"({with_std(value / 10**power, std / 10**power)}) · 10{str(power).translate(RAISED)}"
    decimals = -math.floor(math.log10(float(f"{std:.0e}")))
    return f"{_rounded(value, decimals)} ± {_rounded(std, decimals)}"


def _rounded(value: float, decimals: int) -> str:
    return f"{round(value, decimals) + 0.0:.{max(decimals, 0)}f}"  # what rounds to -0 is 0


TEMPLATES.env.filters |= {"time": time, "with_std": with_std, "unit": unit, "shown": shown}
