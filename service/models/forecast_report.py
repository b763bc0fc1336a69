"""Forecasts as reports, for a terminal and as an HTML file."""

from collections.abc import Sequence

from core.tables import Table
from core.workbench.forecasting import forecast_sentences, forecast_table
from service.models import texts
from service.models.figures.forecasts import forecast_figures
from service.models.forecast_results import document
from service.models.forecasting import Forecasts
from service.reports.document import Document, Part, notes, paragraph
from service.verdict import texts as verdict_texts
from service.verdict.checks import Check


def forecast(done: Forecasts) -> Document:
    """Forecasts for a terminal: peaks with their intervals, warnings, and the building's limits."""
    return Document(texts.FORECAST_TITLE.format(_subject(done)), _forecasts(done, with_figures=False))


def forecast_file(done: Forecasts) -> Document:
    """Forecasts with their figures."""
    return Document(texts.FORECAST_TITLE.format(_subject(done)), _forecasts(done, with_figures=True))


def _forecasts(done: Forecasts, *, with_figures: bool) -> tuple[Part, ...]:
    drawn = document(done).forecasts if with_figures else [None] * len(done.result.forecasts)
    each = zip(done.result.forecasts, done.checks, drawn, strict=True)
    parts: list[Part] = []
    for one, checks, shown in each:
        parts += [forecast_table(one), paragraph(forecast_sentences(one)), limits_table(checks)]
        parts += [] if shown is None else forecast_figures(shown)
    return (
        *parts,
        notes((*done.result.sources, *(f"not used: {reason}" for reason in done.result.earthquakes.unused))),
    )


def limits_table(checks: Sequence[Check]) -> Table:
    """Checks of a forecast, each with the share of the limit that decides it."""
    rows = tuple(
        (verdict_texts.title(one), verdict_texts.value(one), verdict_texts.limit(one), _share(one), one.outcome.value)
        for one in checks
    )
    headings = ("check", "forecast", "limit", "share", "outcome")
    return Table(texts.LIMITS_CAPTION, headings, rows, texts.LIMITS_NOTE, texts=("outcome",))


def _share(check: Check) -> str:
    if check.value is None or check.limit is None:
        return ""
    share = f"{100 * abs(check.value) / check.limit:.0f} %"
    if check.uncertainty is None:
        return share
    return f"{share} (to {100 * (abs(check.value) + check.uncertainty) / check.limit:.0f} %)"


def _subject(done: Forecasts) -> str:
    return f"{done.given.building}, direction {done.given.direction}"
