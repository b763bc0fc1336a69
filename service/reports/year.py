"""The report on one year of a building, assembled from stored facts: one object, from which HTML and PDF are made."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from zoneinfo import ZoneInfo

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from core.rounding import significant, with_std
from service.analyses.tables import Analysis, DirectionResult, LayerResult, ShakingResult
from service.buildings import queries as building_queries, store as building_store
from service.db.select import Line, Question
from service.drift.tables import DriftValue, MonitoredSeries
from service.language.translation import gettext, said
from service.records.tables import Event
from service.reports import texts
from service.reports.building_year import (
    LISTED,
    AlertLine,
    BuildingYear,
    InspectionLine,
    MessageLine,
    alert_lines,
    gaps,
    inspection_lines,
    message_lines,
)
from service.reports.earthquake import DIGITS, GAL, MM, Fact, said_fact
from service.reports.texts import clipped, shown
from service.verdict import reading, texts as verdict_texts
from service.verdict.checks import LEVELS, Level
from service.verdict.earthquakes import of_events
from service.version import VERSION, code_digest

EARTHQUAKES, PROGRAM = "Earthquakes", "Program"
YEARS = range(1900, 2101)
"""Years that a report may be about."""
POINTS = 800
"""Values of a trend in one direction: of more, every second, third ... is drawn."""
TRENDS = ("stiffness", "damping")
TrendPoint = tuple[datetime, float, float, bool]
"""Start of an earthquake, relative change, its standard deviation, whether it belongs to the reference."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EarthquakeLine:
    """One earthquake of the year."""

    time: str
    level: str
    words: str
    """The level in words."""
    intensity: str
    pga: str
    displacement: str
    change: str
    """Changes of stiffness by direction."""
    note: str
    """Why it has no result; empty if it has."""


@dataclass(frozen=True, slots=True, kw_only=True)
class YearReport:
    """Everything that the report says in words; all texts are for display."""

    code: str
    building: str
    year: int
    slug: str
    stamps: tuple[str, ...]
    period: str
    level: str
    words: str
    headline: str
    """The verdict on the building now, with its first reason."""
    basis: str
    """Its basis in words: automatic, or an inspection."""
    summary: tuple[Fact, ...]
    earthquakes: tuple[EarthquakeLine, ...]
    alerts: tuple[AlertLine, ...]
    inspections: tuple[InspectionLine, ...]
    messages: tuple[MessageLine, ...]
    gaps: tuple[Fact, ...]
    """Times without usable records: when, and why."""
    omitted: tuple[str, ...]
    """Numbers of entries that are not listed, in words."""
    trends: tuple[tuple[str, tuple[tuple[str, tuple[TrendPoint, ...]], ...]], ...]
    """By quantity and direction, up to the end of the year."""
    provenance: tuple[Fact, ...]
    contact: str


def year_report(session: Session, code: str, year: int, now: datetime) -> YearReport:
    """The report on a building's year.

    Args:
        session: to read with.
        code: of the building.
        year: one of YEARS, in the building's time zone.
        now: aware time.

    Raises:
        NotFoundError: there is no such building.
    """
    building, revision = building_queries.building(session, code)
    file = building_store.parsed(revision)
    zone = ZoneInfo(file.timezone)
    start, end = (datetime(one, 1, 1, tzinfo=zone) for one in (year, year + 1))
    of = BuildingYear(session, building, start, end, zone, None if now < end else end)
    verdict = reading.of_building(session, building)
    changes = {quantity: _values(of, quantity) for quantity in TRENDS}
    earthquakes, levels, omitted = _earthquakes(of, _changes(of, changes["stiffness"]))
    messages, more = message_lines(of)
    alerts, inspections = alert_lines(of), tuple(inspection_lines(of))
    return YearReport(
        code=code,
        building=clipped(building.name, texts.LONGEST_NAME),
        year=year,
        slug=str(year),
        stamps=(said("THE YEAR IS NOT OVER: this report shows it so far."),) if of.at is None else (),
        period=said(f"{start:%-d %B %Y} to 31 December {year} ({file.timezone})"),
        level=verdict.level.value,
        words=said(verdict.level.words).upper(),
        headline=shown(verdict_texts.headline(verdict)),
        basis=shown(verdict_texts.inspected(verdict) or texts.AUTOMATIC),
        summary=tuple(map(said_fact, _summary(of, levels, len(alerts), len(inspections)))),
        earthquakes=earthquakes,
        alerts=alerts,
        inspections=inspections,
        messages=messages,
        gaps=tuple(map(said_fact, gaps(of))),
        omitted=tuple(map(said, (*omitted, *more))),
        trends=tuple((quantity, _trend(rows)) for quantity, rows in changes.items()),
        provenance=(
            said_fact(Fact(PROGRAM, f"Menshin {VERSION}, code {code_digest()[:DIGITS]}")),
            said_fact(Fact("Building file", f"revision {revision.number}")),
        ),
        contact=texts.contacts(file),
    )


def _summary(of: BuildingYear, levels: Sequence[Level], alerts: int, inspections: int) -> Iterator[Fact]:
    named = {level: {"number": levels.count(level), "words": said(level.words)} for level in LEVELS if level in levels}
    counted = ", ".join(gettext(texts.COUNTED) % one for one in named.values())
    total = of.session.scalar(of.events(select(func.count()).select_from(Event))) or 0
    yield Fact(EARTHQUAKES, f"{total}" + (f": {counted}" if counted else ""))
    moved = func.max(func.coalesce(LayerResult.peak_resultant, DirectionResult.peak_displacement))
    largest, intensity = of.session.execute(
        _results(of).with_only_columns(moved, func.max(ShakingResult.intensity))
    ).one()
    yield Fact("Largest displacement", "not known" if largest is None else f"{significant(largest * MM)} mm")
    yield Fact("Largest JMA intensity", "not known" if intensity is None else f"{intensity:.1f} (unofficial)")
    yield Fact("Alerts, inspections", f"{alerts}, {inspections}")


def _results(of: BuildingYear) -> Question:
    """Events of the year with their latest analyses' results, as far as there are any."""
    query = (
        select(Event)
        .outerjoin(Analysis, (Analysis.event_id == Event.id) & Analysis.current)
        .outerjoin(DirectionResult, DirectionResult.analysis_id == Analysis.id)
        .outerjoin(LayerResult, LayerResult.analysis_id == Analysis.id)
        .outerjoin(ShakingResult, ShakingResult.analysis_id == Analysis.id)
    )
    return of.events(query)


def _earthquakes(
    of: BuildingYear, changes: Mapping[int, str]
) -> tuple[tuple[EarthquakeLine, ...], list[Level], tuple[str, ...]]:
    """The strongest earthquakes of the year in order of time, their levels, and how many are not listed."""
    moved = func.max(func.coalesce(LayerResult.peak_resultant, DirectionResult.peak_displacement)).label("moved")
    intensity = func.max(ShakingResult.intensity).label("intensity")
    columns = (Event.id, func.max(Analysis.pga).label("pga"), moved, intensity)
    query = _results(of).with_only_columns(*columns).group_by(Event.id)
    rows = sorted(of.session.execute(query).all(), key=lambda row: (-(row.moved or 0.0), row.id))
    listed = {row.id: row for row in rows[:LISTED]}
    events = of.session.scalars(select(Event).where(Event.id.in_(listed)).order_by(Event.start, Event.id)).all()
    verdicts = [one.level for one in of_events(of.session, of.building, events, of.at)]
    lines = tuple(
        _earthquake(of, event, level, listed[event.id], changes.get(event.id, ""))
        for event, level in zip(events, verdicts, strict=True)
    )
    more = len(rows) - len(lines)
    omitted = () if not more else (f"{more} weaker earthquakes are not listed, and not among the counts by level.",)
    return lines, verdicts, omitted


def _earthquake(of: BuildingYear, event: Event, level: Level, row: Line, change: str) -> EarthquakeLine:
    is_known = event.state == "analysed"
    return EarthquakeLine(
        time=f"{event.start.astimezone(of.zone):%Y-%m-%d %H:%M:%S}",
        level=level.value,
        words=said(level.words),
        intensity="–" if row.intensity is None else f"{row.intensity:.1f}",
        pga="–" if row.pga is None else significant(row.pga * GAL),
        displacement="–" if row.moved is None else significant(row.moved * MM),
        change=change or "–",
        note="" if is_known else shown(f"{event.state}: {event.reason or 'no result yet'}", 160),
    )


def _values(of: BuildingYear, quantity: str) -> Sequence[Line]:
    """(event, start, subject, value, std, is_reference, is_excluded, is_beyond) of a quantity, in order of time."""
    columns = (DriftValue.event_id, Event.start, MonitoredSeries.subject, DriftValue.value, DriftValue.std)
    kinds = (DriftValue.is_reference, DriftValue.is_excluded, DriftValue.is_beyond)
    query = select(*columns, *kinds).join(MonitoredSeries, MonitoredSeries.id == DriftValue.series_id)
    of_series = (MonitoredSeries.building_id == of.building.id, MonitoredSeries.quantity == quantity)
    query = query.join(Event, Event.id == DriftValue.event_id).where(
        *of_series, MonitoredSeries.subject.in_(("x", "y"))
    )
    return of.session.execute(query.where(Event.start < of.end).order_by(Event.start, Event.id)).all()


def _changes(of: BuildingYear, rows: Sequence[Line]) -> dict[int, str]:
    """Changes of stiffness by event: `x −7.8 ± 0.6 %, y not compared`; those of the reference period have none."""
    by_event: dict[int, list[str]] = {}
    for row in rows:
        if row.start >= of.start and not row.is_reference:
            change = (
                f"{row.subject} {_percent(row.value, row.std)}" if _is_judged(row) else f"{row.subject} not compared"
            )
            by_event.setdefault(row.event_id, []).append(change)
    return {event: ", ".join(sorted(parts)) for event, parts in by_event.items()}


def _is_judged(row: Line) -> bool:
    """False where a data problem, or amplitudes outside the reference's, keep a value out of the comparison."""
    return not (row.is_excluded or row.is_beyond)


def _percent(change: float, std: float) -> str:
    """A change with its 95 % uncertainty."""
    return f"{'+' if change > 0 else ''}{with_std(100 * change, 200 * std, '%')}"


def _trend(rows: Sequence[Line]) -> tuple[tuple[str, tuple[TrendPoint, ...]], ...]:
    """Points by direction of what is compared; directions without any are omitted."""
    judged = [row for row in rows if _is_judged(row)]
    by_direction = {name: [row for row in judged if row.subject == name] for name in ("x", "y")}
    return tuple((name, tuple(_thinned(own))) for name, own in by_direction.items() if own)


def _thinned(rows: Sequence[Line]) -> Iterator[TrendPoint]:
    for row in rows[:: -(-len(rows) // POINTS)]:
        yield row.start, row.value, row.std, row.is_reference
