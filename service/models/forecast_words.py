"""Rows of a forecast's page: values in the units and with the digits that people read."""

from dataclasses import dataclass

from core.forecasting.response import Peak
from core.rounding import plain, with_std
from core.workbench.forecasting import named, written
from service.models.forecast_results import LimitOut, MarginOut, PeakOut
from service.verdict.checks import Check, Level, Outcome
from service.verdict.texts import outcome, shown_unit


@dataclass(frozen=True, slots=True)
class PeakRow:
    """One peak."""

    name: str
    level: str
    direction: str
    value: str
    interval: str


@dataclass(frozen=True, slots=True)
class LimitRow:
    """One check."""

    title: str
    value: str
    margins: tuple[tuple[str, str, str], ...]
    """Level, limit and share of each limit."""
    outcome: str
    """In the language of the page."""
    reason: str
    """Why it is undecided; empty otherwise."""
    remedy: str


def peak_row(one: PeakOut) -> PeakRow:
    """A peak as a row."""
    peak = Peak(
        quantity=one.quantity,  # type: ignore[arg-type]  # written by this program
        level=one.level,
        direction=one.direction,
        value=one.value or 0.0,
        low=one.low or 0.0,
        high=one.high or 0.0,
        by_values=one.by_values or 0.0,
        by_model=one.by_model or 0.0,
    )
    value, _, ends = written(peak).partition(" (95 %: ")
    interval = ends.rstrip(")").replace(" to ", " – ")
    return PeakRow(named(peak), one.level, one.direction, value, interval)


def limit_row(one: LimitOut) -> LimitRow:
    """A check as a row."""
    check = Check(name=one.check, outcome=Outcome(one.outcome), level=Level(one.leads_to), unit=one.unit)
    unit, factor = shown_unit(check)
    value = "" if one.value is None else with_std(factor * one.value, _scaled(one.uncertainty, factor), unit)
    margins = tuple(
        (margin.level, f"{plain(factor * (margin.limit or 0.0))} {unit}".rstrip(), _share(margin))
        for margin in one.margins
    )
    return LimitRow(one.title, value, margins, outcome(check), one.reason, one.remedy)


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else factor * value


def _share(margin: MarginOut) -> str:
    if margin.share is None:
        return ""
    share = f"{100 * margin.share:.0f} %"
    return share if margin.share_high is None else f"{share} ({100 * margin.share_high:.0f} %)"
