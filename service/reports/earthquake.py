"""The report on one earthquake, assembled from stored facts: one object, from which HTML and PDF are made."""

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC
from zoneinfo import ZoneInfo

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from core.rounding import significant, with_std
from core.shaking.classes import long_period_class
from service.alerts.tables import BuildingInspection
from service.analyses import queries as analysis_queries
from service.analyses.tables import DELETED, Analysis, DirectionResult, ShakingResult
from service.buildings import store as building_store
from service.buildings.description import BuildingFile
from service.buildings.tables import Building, Revision
from service.db.select import Question
from service.language.translation import said
from service.records import queries as record_queries
from service.records.tables import Event, SourceState
from service.reports import texts
from service.reports.check_lines import CheckLine, Place, advice, check_lines, places
from service.reports.texts import clipped, listed, shown
from service.verdict import reading, texts as verdict_texts
from service.verdict.assessment import Assessment
from service.verdict.checks import COVERAGE, Level
from service.version import VERSION, code_digest

GAL, CM, MM, KN = 1e2, 1e2, 1e3, 1e-3
MOST_ALERTS, MOST_FINDINGS = 4, 4
"""Sentences of a kind on the page; more are counted."""
EARLIER = 5
"""Loops of earlier earthquakes on the page, the largest."""
ABOVE = ("Peak acceleration above the isolators", "Peak velocity above the isolators")
"""In place of PGA and PGV where the ground was not recorded."""
GROUND, TEMPERATURE, NO_RECORDINGS = "ground", "Temperature", "none"
DIGITS = 16
"""Hexadecimal digits of a digest on the page: 64 bits."""


@dataclass(frozen=True, slots=True)
class Fact:
    """A name and its value, for display."""

    name: str
    value: str


def said_fact(fact: Fact) -> Fact:
    """The same in the language of the report."""
    return Fact(said(fact.name), said(fact.value))


@dataclass(frozen=True, slots=True, kw_only=True)
class EarthquakeReport:
    """Everything that the page says in words; all texts are for display."""

    event: int
    analysis: int | None
    """Number of the latest analysis; None before it."""
    direction: str | None
    """Direction in which the isolators moved most, of which histories and loops are; None without a result."""
    earlier: tuple[int, ...]
    """Numbers of the direction results of the largest earlier earthquakes, whose loops are drawn."""
    stamps: tuple[str, ...]
    """Words that come before all else: provisional, or a drill."""
    building: str
    code: str
    time: str
    """Local time of the building."""
    utc: str
    slug: str
    """The time as a part of a file's name."""
    level: str
    words: str
    """The level in words."""
    meaning: str
    reason: str
    """The first reason of the level, and how many alerts are open; empty without a usable record."""
    statements: tuple[str, ...]
    """Number of passed checks, and everything that weakens the verdict."""
    revision: str
    measures: tuple[Fact, ...]
    checks: tuple[CheckLine, ...]
    places: tuple[Place, ...]
    advice: str
    alerts: tuple[str, ...]
    inspections: tuple[str, ...]
    """Signed inspections of the building since the earthquake."""
    sensors: tuple[str, ...]
    provenance: tuple[Fact, ...]
    contact: str


def earthquake_report(session: Session, event_id: int, mark: str = "") -> EarthquakeReport:
    """The report on an earthquake by its latest analysis and the alerts that are open now.

    Args:
        session: to read with.
        event_id: number of the event.
        mark: stamp of a message that is not real; empty otherwise.

    Raises:
        NotFoundError: there is no such event.
    """
    event, analysis = record_queries.event_with_analysis(session, event_id)
    building = session.get_one(Building, event.building_id)
    file = building_store.described(session, building)
    verdict = reading.of_event(session, event)
    results = analysis_queries.direction_results(session, analysis.id) if analysis else ()
    shaking = analysis_queries.shaking_result(session, analysis.id) if analysis else None
    direction = main_direction(results)
    zone = ZoneInfo(file.timezone)
    meaning, *statements = verdict_texts.opening(verdict)
    return EarthquakeReport(
        event=event.id,
        analysis=analysis.id if analysis else None,
        direction=direction,
        earlier=_earlier(session, event, direction),
        stamps=tuple(map(said, _stamps(verdict, mark))),
        building=clipped(building.name, texts.LONGEST_NAME),
        code=building.code,
        time=said(f"{event.start.astimezone(zone):%-d %B %Y, %H:%M:%S} ({file.timezone})"),
        utc=f"{event.start.astimezone(UTC):%Y-%m-%d %H:%M:%S} UTC",
        slug=f"{event.start.astimezone(UTC):%Y-%m-%dT%H%M%SZ}",
        level=verdict.level.value,
        words=said(verdict.level.words).upper(),
        meaning=shown(meaning.partition(". ")[2]),
        reason=_reason(verdict),
        statements=tuple(map(shown, statements)),
        revision=said(_revision(session, event, analysis, zone)),
        measures=tuple(map(said_fact, _measures(analysis, results, shaking, file))),
        checks=check_lines(verdict),
        places=places(verdict),
        advice=advice(verdict),
        alerts=_alerts(verdict),
        inspections=_inspections(session, event, zone),
        sensors=_sensors(session, event, analysis, file),
        provenance=tuple(map(said_fact, _provenance(session, building, analysis, file))),
        contact=texts.contacts(file),
    )


def main_direction(results: Sequence[DirectionResult]) -> str | None:
    """The direction of the largest displacement; of the largest force where no displacement was measured."""
    largest = max(results, key=lambda one: (one.peak_displacement or 0.0, one.peak_force), default=None)
    return None if largest is None else largest.direction


def loops() -> Question:
    """Direction results whose loop is stored."""
    stored = (DirectionResult.displacement.is_not(None), func.length(DirectionResult.force) > len(DELETED))
    return select(DirectionResult).where(*stored)


def _earlier(session: Session, event: Event, direction: str | None) -> tuple[int, ...]:
    before = (Event.building_id == event.building_id, Event.start < event.start, Analysis.current)
    query = loops().with_only_columns(DirectionResult.id).join(Analysis, Analysis.id == DirectionResult.analysis_id)
    query = query.join(Event, Event.id == Analysis.event_id).where(*before, DirectionResult.direction == direction)
    return tuple(session.scalars(query.order_by(DirectionResult.peak_displacement.desc()).limit(EARLIER)))


def _reason(verdict: Assessment) -> str:
    """The first reason of the level; empty where the statements after it say the same."""
    if verdict.level in (Level.NO_DATA, Level.NORMAL):
        return ""
    return shown(verdict_texts.headline(verdict).partition(": ")[2])


def _stamps(verdict: Assessment, mark: str) -> Iterator[str]:
    if mark:
        yield texts.DRILL.format(mark=mark)
    if verdict.provisional:
        yield texts.PROVISIONAL.format(reason=verdict.provisional.rstrip("."))


def _revision(session: Session, event: Event, analysis: Analysis | None, zone: ZoneInfo) -> str:
    if analysis is None:
        return "Not analysed yet"
    number = session.scalar(
        select(func.count()).select_from(Analysis).where(Analysis.event_id == event.id, Analysis.id <= analysis.id)
    )
    return f"Revision {number}, analysed {analysis.created_at.astimezone(zone):%Y-%m-%d %H:%M}"


def _measures(
    analysis: Analysis | None, results: Sequence[DirectionResult], shaking: ShakingResult | None, file: BuildingFile
) -> Iterator[Fact]:
    """Strength of the shaking, and the answer of the building."""
    if shaking is not None:
        yield from _strength(shaking)
        yield from _amplification(shaking, file)
    for one in results:
        if one.peak_displacement is not None:
            peak = with_std(one.peak_displacement * MM, _twice(one.peak_displacement_std, MM), "mm")
            yield Fact(f"Isolators moved, {one.direction}", peak)
        force = with_std(one.peak_force * KN, _twice(one.force_std, KN), "kN")
        yield Fact(f"Force in the isolators, {one.direction}", force)
    if analysis is not None and analysis.temperature is not None:
        yield Fact(TEMPERATURE, f"{analysis.temperature:.1f} °C")


def _strength(shaking: ShakingResult) -> Iterator[Fact]:
    where = GROUND if shaking.is_below_isolators else f"{clipped(shaking.level, 24)}, above the isolators"
    if shaking.intensity is not None:
        yield Fact("JMA intensity (unofficial)", f"{shaking.intensity:.1f}, {where}")
    response = significant(shaking.long_period_velocity * CM)
    long_period = long_period_class(shaking.long_period_velocity)
    yield Fact("Long-period class (unofficial)", f"{long_period}, {response} cm/s")
    acceleration, velocity = ("PGA", "PGV") if shaking.is_below_isolators else ABOVE
    yield Fact(acceleration, f"{significant(shaking.pga * GAL)} gal")
    yield Fact(velocity, f"{significant(shaking.pgv * CM)} cm/s")
    yield Fact("Arias intensity", f"{significant(shaking.arias)} m/s")
    yield Fact("Duration, 5–95 % of Arias", f"{significant(shaking.duration)} s")


def _amplification(shaking: ShakingResult, file: BuildingFile) -> Iterator[Fact]:
    """Largest acceleration of base slab and roof, over that of the ground where it was recorded."""
    for name, level in (
        ("Base slab acceleration", file.description.base.name),
        ("Roof acceleration", file.description.floors[-1].name),
    ):
        floors = [one for one in shaking.floors if one["level"] == level]
        if not floors:
            continue
        largest = max(floors, key=lambda one: float(one["peak"]))
        text = f"{significant(largest['peak'] * GAL)} gal" + ("" if largest["is_measured"] else ", estimated")
        if shaking.is_below_isolators and shaking.pga > 0:
            text += f": {largest['peak'] / shaking.pga:.2f} × ground"
        yield Fact(name, text)


def _twice(std: float | None, factor: float) -> float | None:
    """95 %, in the unit shown."""
    return None if std is None else COVERAGE * std * factor


def _alerts(verdict: Assessment) -> tuple[str, ...]:
    lines = [
        shown(f"Alert {one.id}, {verdict_texts.STATE_NAMES.get(one.state, one.state)}: {one.summary}", 200)
        for one in verdict.alerts
    ]
    none = "No alert is open. This alone does not mean that the building is normal."
    return listed(lines, MOST_ALERTS) or (said(none),)


def _inspections(session: Session, event: Event, zone: ZoneInfo) -> tuple[str, ...]:
    later = (BuildingInspection.building_id == event.building_id, BuildingInspection.inspected_at >= event.end)
    rows = session.scalars(select(BuildingInspection).where(*later).order_by(BuildingInspection.inspected_at))
    lines = [
        clipped(
            f"{one.inspected_at.astimezone(zone):%Y-%m-%d %H:%M}, {one.by}: "
            f"{said(verdict_texts.RESULTS[one.result])}. {one.comment}",
            200,
        )
        for one in rows
    ]
    return listed(lines, MOST_ALERTS)


def _sensors(session: Session, event: Event, analysis: Analysis | None, file: BuildingFile) -> tuple[str, ...]:
    """Channels that were recorded, data problems, and the clock of the records."""
    recorded = {one.channel for one in record_queries.event(session, event.id).waveforms}
    described = [one.id for one in file.description.channels]
    silent = [clipped(one, 64) for one in described if one not in recorded]
    recorded_ones = len(described) - len(silent)
    missing = ", ".join(silent[:MOST_FINDINGS]) + (" …" if len(silent) > MOST_FINDINGS else "")
    first = f"{recorded_ones} of {len(described)} channels recorded."
    if silent:
        first = f"{recorded_ones} of {len(described)} channels recorded; missing: {missing}."
    lines = [said(first)]
    findings = [] if analysis is None else [one for one in analysis.quality if one["severity"] != "note"]
    lines += listed(
        [
            clipped(f"{said(one['severity'])}: {one.get('channel') or ''} {said(one['message'])}", 200)
            for one in findings
        ],
        MOST_FINDINGS,
    )
    if analysis is not None and not findings:
        lines.append(said("No warning from the data quality checks."))
    return (*lines, said(_clock(session, event, findings)))


def _clock(session: Session, event: Event, findings: Sequence[dict[str, str]]) -> str:
    if any(one["kind"] in ("clock", "delay") for one in findings):
        return "The clocks of the records have a problem: see above."
    ahead = session.scalar(select(SourceState.clock_ahead).where(SourceState.building_id == event.building_id))
    if ahead is None:
        return "Times are the recorder's; its server does not state its clock."
    if ahead > 0:
        return f"Times are the recorder's; its server's clock was {ahead:.1f} s ahead of Menshin's at the last poll."
    return f"Times are the recorder's; its server's clock was {-ahead:.1f} s behind Menshin's at the last poll."


def _provenance(session: Session, building: Building, analysis: Analysis | None, file: BuildingFile) -> Iterator[Fact]:
    """Versions and digests of everything that the page depends on, so that it can be made again."""
    current = building_store.current(session, building)
    yield Fact("Program of the verdict", f"Menshin {VERSION}, code {code_digest()[:DIGITS]}")
    yield Fact("Building file", f"revision {current.number}, {_digest(*_described(file))}")
    if analysis is None:
        return
    estimator = "" if analysis.estimator is None else f", estimator {analysis.estimator}"
    yield Fact("Program of the analysis", f"Menshin {analysis.version}{estimator}")
    made_with = building_store.parsed(session.get_one(Revision, analysis.revision_id))
    settings = _digest(json.dumps(analysis.settings, sort_keys=True), *_described(made_with))
    yield Fact("Settings and building of the analysis", settings)
    yield Fact(f"{len(analysis.inputs)} recordings", _digest(*analysis.inputs) if analysis.inputs else NO_RECORDINGS)


def _described(file: BuildingFile) -> tuple[object, ...]:
    """The parts of a building file that describe the building; no addresses of sources, no secrets."""
    return file.description, file.gains, file.limits, file.design_spectrum, file.contacts


def _digest(*values: object) -> str:
    """SHA-256 of some values, shortened."""
    return hashlib.sha256(repr(values).encode()).hexdigest()[:DIGITS]
