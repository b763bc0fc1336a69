"""The API of reports on earthquakes and years, as PDF and HTML.

The parameter `language` is read with each request (`service.http.languages`).
"""

from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from typing import Annotated, Literal

from fastapi import APIRouter, Depends, Path, Query
from sqlalchemy.orm import Session, sessionmaker

from service.http.parameters import Code, Id, Reading
from service.http.responses import Tagged, TaggedRoute, file_responses
from service.language.choice import Language
from service.reports import rendering
from service.reports.earthquake import earthquake_report
from service.reports.pictures import Picture, pictures, year_pictures
from service.reports.rendering import Report
from service.reports.year import YEARS, year_report

PDF, HTML = "application/pdf", "text/html"
Form = Literal["pdf", "html"]
Year = Annotated[
    int, Path(description="Year, in the building's time zone.", ge=YEARS[0], le=YEARS[-1], examples=[2026])
]
Shown = Annotated[
    Language | None,
    Query(
        description="Language of the report; without it the header Accept-Language decides, and English is the default."
    ),
]
MEDIA_TYPES = {"pdf": PDF, "html": HTML}


def _declared(language: Shown = None) -> None:
    """The parameter `language` of a report."""


router = APIRouter(tags=["reports"], route_class=TaggedRoute, dependencies=[Depends(_declared)])


@router.get(
    "/events/{event_id}/report.pdf",
    operation_id="get_event_report_pdf",
    **file_responses(PDF, "One page of A4.", 404),
)
def earthquake_pdf(event_id: Id, sessions: Reading) -> Tagged:
    """The report on an earthquake for paper, by its latest analysis and the alerts that are open now."""
    return _of_earthquake(sessions, event_id, "pdf")


@router.get(
    "/events/{event_id}/report.html",
    operation_id="get_event_report_html",
    **file_responses(HTML, "One file without a script.", 404),
)
def earthquake_html(event_id: Id, sessions: Reading) -> Tagged:
    """The same report for a screen."""
    return _of_earthquake(sessions, event_id, "html")


@router.get(
    "/buildings/{code}/reports/{year}.pdf",
    operation_id="get_year_report_pdf",
    **file_responses(PDF, "Pages of A4.", 404),
)
def year_pdf(code: Code, year: Year, sessions: Reading) -> Tagged:
    """The report on a building's year for paper: trends, earthquakes, alerts, inspections, messages."""
    return _of_year(sessions, code, year, "pdf")


@router.get(
    "/buildings/{code}/reports/{year}.html",
    operation_id="get_year_report_html",
    **file_responses(HTML, "One file without a script.", 404),
)
def year_html(code: Code, year: Year, sessions: Reading) -> Tagged:
    """The same report for a screen."""
    return _of_year(sessions, code, year, "html")


def _of_year(sessions: sessionmaker[Session], code: str, year: int, form: Form) -> Tagged:
    with sessions() as session:
        report = year_report(session, code, year, datetime.now(UTC))
    return _answer(report, form, lambda: year_pictures(report))


def _of_earthquake(sessions: sessionmaker[Session], event_id: int, form: Form) -> Tagged:
    with sessions() as session:
        report = earthquake_report(session, event_id)

    def draw() -> Sequence[Picture]:
        with sessions() as session:
            return pictures(session, report)

    return _answer(report, form, draw)


def _answer(report: Report, form: Form, draw: Callable[[], Sequence[Picture]]) -> Tagged:
    """A report, drawn only for a client without a current copy."""
    made = Tagged(lambda: rendering.FORMS[form](report, draw(), datetime.now(UTC)), MEDIA_TYPES[form], "report", report)
    made.name = rendering.file_name(report, form)
    return made
