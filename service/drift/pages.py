"""The page of a building's drift, and its pictures."""

from collections.abc import Mapping, Sequence
from itertools import groupby
from operator import attrgetter
from typing import Annotated

from fastapi import APIRouter, Depends, Query, Request, Response
from sqlalchemy.orm import Session

from core.drift.alarms import printed_change
from core.drift.quantities import BOTH_DIRECTIONS, LAYER_QUANTITIES, QUANTITIES
from service.access.pages import reader
from service.analyses import history as analysis_history
from service.buildings import queries as building_queries, store as building_store
from service.buildings.reference_periods import in_force
from service.db.select import Span
from service.documents.charts import Picture
from service.drift import charts, queries, texts
from service.drift.api import TEXT
from service.drift.baseline import baseline_answer
from service.drift.charts import CURVES
from service.drift.schema import DriftAlarmRow, DriftRow, QuantityName, SeriesRow
from service.drift.tables import ReferencePeriod
from service.errors import NotFoundError
from service.http.parameters import Code, Reading
from service.http.rendering import As, page, picture
from service.http.responses import TaggedRoute
from service.jobs import queue as job_queue

VALUES = 3000
"""Most points in a picture: more cannot be distinguished."""

router = APIRouter(include_in_schema=False, dependencies=[Depends(reader)], route_class=TaggedRoute)
BuildingCode = Annotated[str, Query(pattern=r"^[A-Za-z0-9_-]{1,32}$")]
Quantity = Annotated[QuantityName, Query()]
Subject = Annotated[str, Query(pattern=TEXT)]


@router.get("/buildings/{code}/drift")
def drift_page(request: Request, code: Code, sessions: Reading) -> Response:
    """Every monitored series of a building with its baseline, values and alarms."""
    with sessions() as session:
        building, _ = building_queries.building(session, code)
        series = queries.series_rows(session, building.id)
        alarms = queries.alarm_rows(session, building.id)
        periods = analysis_history.reference_periods(session, building.id)
        return page(
            request,
            "drift",
            building=building,
            zone=building_store.zone(session, building),
            quantities=_by_quantity(series),
            alarms=alarms,
            periods=periods[::-1],
            unjudged=_unjudged(series, periods),
            is_pending=job_queue.is_monitoring_pending(session, building.id),
            curves=CURVES,
            opened={*LAYER_QUANTITIES, *(one.quantity for one in alarms)},
            quantity_names=texts.NAMES,
            named=charts.named,
            change=lambda row: printed_change(QUANTITIES[row.quantity], row.drift, row.low, row.high),
            both=BOTH_DIRECTIONS,
        )


def _unjudged(series: Sequence[SeriesRow], periods: Sequence[ReferencePeriod]) -> list[str]:
    """One sentence of each quantity that cannot raise an alarm yet: how many earthquakes it needs, and why."""
    sentences = []
    for quantity, rows in _by_quantity(series):
        own = [one for one in rows if one.subject != BOTH_DIRECTIONS]
        if lacking := [one for one in own if one.wanted]:
            most = max(lacking, key=lambda one: one.wanted)
            named = "" if lacking == own else f" ({'; '.join(charts.named(one.subject) for one in lacking)})"
            need = _need(most.wanted, in_force(periods, quantity, most.subject))
            sentences.append(f"{most.title.capitalize()}{named}: {need}.")
    return sentences


def _need(wanted: int, period: ReferencePeriod | None) -> str:
    needs = f"needs {wanted} more earthquake{'s' * (wanted > 1)} before it can raise an alarm"
    if period is None or period.start is None:
        return needs
    return f"a new reference period began on {period.start:%Y-%m-%d %H:%M} UTC; {needs}"


def _by_quantity(series: Sequence[SeriesRow]) -> list[tuple[str, list[SeriesRow]]]:
    """Series by quantity in core's order, the layer's first, and the mean of both directions after each."""
    ordered = sorted(series, key=lambda one: one.subject == BOTH_DIRECTIONS)
    return [(name, own) for name in QUANTITIES if (own := [one for one in ordered if one.quantity == name])]


@router.get("/charts/baseline.{form}")
def baseline(wanted: As, sessions: Reading, building: BuildingCode, quantity: Quantity, subject: Subject) -> Response:
    """The expected values of a series over amplitude, and the latest event, at that event's temperature."""
    if quantity not in CURVES:
        raise NotFoundError("curve over amplitude of", quantity)
    with sessions() as session:
        row, _ = building_queries.building(session, building)
        series = queries.one_series(session, row.id, quantity, subject)
        last = queries.latest_value(session, series.id)
    if last is None:
        raise NotFoundError("value yet of", f"{quantity}/{subject}")

    def draw() -> Picture:
        with sessions() as session:
            latest = queries.observations(session, row.id, quantity, subject, last.event_id)
        known = baseline_answer(building, series, latest[-1].temperature, 80)
        if not known.items:
            raise NotFoundError("baseline yet of", f"{quantity}/{subject}")
        return charts.expectation(known, latest, charts.titled(QUANTITIES[quantity].title.capitalize(), subject))

    return picture(wanted, draw, "baseline", series.id, series.job_id)


@router.get("/charts/drift.{form}")
def history(wanted: As, sessions: Reading, building: BuildingCode, quantity: Quantity) -> Response:
    """Differences of the events from the baseline over the years, a panel for each subject of a quantity."""
    with sessions() as session:
        row, _ = building_queries.building(session, building)
        values = _values(session, row.id, quantity)
        alarms = [one for one in queries.alarm_rows(session, row.id) if one.quantity == quantity]
    if not values:
        raise NotFoundError("drift of", quantity)
    title = QUANTITIES[quantity].title.capitalize()
    by_subject = _by_subject(alarms)
    return picture(wanted, lambda: charts.history(quantity, values, by_subject, title), "drift", values, alarms)


def _values(session: Session, building_id: int, quantity: str) -> Mapping[str, Sequence[DriftRow]]:
    """Values by subject, the mean of both directions last; the earliest event first."""
    rows = queries.values(session, building_id, Span(), quantity, None, None, VALUES)
    names = DriftRow.model_fields
    values = [DriftRow(**{name: row._mapping[name] for name in names}) for row in rows]
    ordered = sorted(values, key=lambda row: (row.subject == BOTH_DIRECTIONS, row.subject, row.event_start))
    return {subject: list(own) for subject, own in groupby(ordered, key=attrgetter("subject"))}


def _by_subject(alarms: Sequence[DriftAlarmRow]) -> Mapping[str, Sequence[DriftAlarmRow]]:
    """In the order in which they were raised."""
    return {subject: list(own) for subject, own in groupby(alarms, key=attrgetter("subject"))}
