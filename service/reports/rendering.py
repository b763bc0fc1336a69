"""Reports as PDF, for paper, and as HTML, for a screen: both from the same object."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from markupsafe import Markup

from service.documents import paper
from service.documents.html import environment, own_ids, rendered
from service.language.translation import said
from service.reports import texts
from service.reports.earthquake import EarthquakeReport
from service.reports.pictures import Picture
from service.reports.year import YearReport
from service.verdict.checks import Level

TEMPLATES = Path(__file__).parent / "templates"
Report = EarthquakeReport | YearReport
SYMBOL = '{% from "http/templates/verdict_parts.html" import symbol %}{{ symbol(level) }}'
DARK = (Level.ACT, Level.INSPECT)
"""Levels that stand in a dark box."""
INKS = (
    "<style>.full{{fill:{ink};stroke:none}}.open{{fill:none;stroke:{ink};stroke-width:2}}"
    ".mark{{fill:none;stroke:{paper};stroke-width:2.5}}</style>"
)
"""Shades of a symbol's parts."""
NAMES: Mapping[type, str] = {EarthquakeReport: "earthquake", YearReport: "year"}
"""Templates by the report: one of Typst, one of HTML."""


def pdf(report: Report, pictures: Sequence[Picture], issued: datetime) -> bytes:
    """The report as PDF; that of an earthquake has one page of A4."""
    return paper.pdf(_template(report), _data(report, pictures, issued), issued)


def pages(report: Report, pictures: Sequence[Picture], issued: datetime) -> list[bytes]:
    """Its pages as PNG, as they are printed."""
    return paper.pictures(_template(report), _data(report, pictures, issued))


def html(report: Report, pictures: Sequence[Picture], issued: datetime) -> bytes:
    """The report as one file of HTML without a script, its pictures within."""
    shown = _data(report, pictures, issued)
    symbol = Markup(shown["symbols"][shown["level"]])
    template = f"reports/templates/{NAMES[type(report)]}.html"
    return rendered(template, report=shown, drawn=_drawn, bar=_bar, symbol=symbol).encode()


Form = Callable[[Report, Sequence[Picture], datetime], bytes]
FORMS: Mapping[str, Form] = {"pdf": pdf, "html": html}
"""By the suffix of a file."""


def file_name(report: Report, suffix: str) -> str:
    """`BNCS-2010-02-27T063411Z-report.pdf`: the building's code has letters that a file name may have."""
    return f"{report.code}-{report.slug}-report.{suffix}"


def _template(report: Report) -> str:
    return (TEMPLATES / f"{NAMES[type(report)]}.typ").read_text("utf-8")


def _data(report: Report, pictures: Sequence[Picture], issued: datetime) -> dict[str, Any]:
    """Values of JSON; pictures by their key."""
    shown = {one.key: asdict(one) | _words(one) for one in pictures}
    shown_report = replace(report, trends=()) if isinstance(report, YearReport) else report  # they are drawn
    symbols = {level.value: _symbol(level, is_white=level.value == report.level) for level in Level}
    when = f"{issued.astimezone(UTC):%Y-%m-%d %H:%M} UTC"
    return asdict(shown_report) | {"pictures": shown, "symbols": symbols, "issued": when}


def _words(picture: Picture) -> dict[str, str]:
    """Description of a picture, in the language of the report."""
    return {"title": said(picture.title), "caption": said(picture.caption), "reason": said(picture.reason)}


def _symbol(level: Level, *, is_white: bool) -> str:
    """A level's symbol, as pages have it: in ink, and white where it stands in a dark box."""
    ink, paper_shade = ("#fff", "#000") if is_white and level in DARK else ("#000", "#fff")
    drawn = environment().from_string(SYMBOL).render(level=level.value)
    style = INKS.format(ink=ink, paper=paper_shade)
    return drawn.replace("<svg ", '<svg xmlns="http://www.w3.org/2000/svg" ', 1).replace(">", f">{style}", 1)


def _drawn(picture: Mapping[str, str]) -> Markup:
    return own_ids(picture["svg"], picture["key"], picture["title"])


def _bar(check: Mapping[str, str]) -> Markup:
    return own_ids(check["bar"], "bar", said(texts.BAR).format(**check))
