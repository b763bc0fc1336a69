"""The API of drift: monitored series, baselines, measurements, values, alarms and reference periods."""

from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Body, Query, Response

from service.analyses import history as analysis_history
from service.buildings import queries as building_queries, reference_periods
from service.drift import queries
from service.drift.baseline import baseline_answer
from service.drift.schema import (
    BaselineOut,
    Drift,
    DriftAlarms,
    Observations,
    QuantityName,
    ReferencePeriodOut,
    ReferencePeriodRequest,
    ReferencePeriods,
    SeriesRows,
)
from service.http.paging import Cursor, RowLimit, page_by_event, place
from service.http.parameters import LARGEST, Code, EventSpan, Reading, Writing
from service.http.responses import TaggedRoute, table_responses
from service.models.api.models import By, making

router = APIRouter(prefix="/buildings/{code}", tags=["drift"], route_class=TaggedRoute)

TEXT = r"^[!-~]{1,80}$"
Quantity = Annotated[QuantityName, Query(description="Monitored quantity.")]
AnyQuantity = Annotated[QuantityName | None, Query(description="Only this quantity.")]
Subject = Annotated[
    str, Query(description="Subject: a direction (`x`), a mode of it (`x/1`) or the id of a channel.", pattern=TEXT)
]
AnySubject = Annotated[
    str | None, Query(description="Only of this direction (`xy`: both by their mean), mode or channel.", pattern=TEXT)
]
Temperature = Annotated[
    float | None, Query(description="°C; without it the mean of the reference.", ge=-60, le=80, allow_inf_nan=False)
]
Grid = Annotated[int, Query(description="Amplitudes of the curve.", ge=2, le=1000)]
AnyEvent = Annotated[int | None, Query(description="Only of the event of this number.", ge=1, le=LARGEST)]


@router.get("/watched", operation_id="list_watched_series", **table_responses(SeriesRows, 404))
def every_series(code: Code, sessions: Reading) -> SeriesRows:
    """Every series of the building that is monitored for drift, with its latest value."""
    with sessions() as session:
        building, _ = building_queries.building(session, code)
        rows = queries.series_rows(session, building.id)
    return SeriesRows(building=code, items=rows, next=None)


@router.get("/baseline", operation_id="get_baseline", **table_responses(BaselineOut, 404))
def baseline(
    code: Code,
    sessions: Reading,
    quantity: Quantity = "stiffness",
    subject: Subject = "x",
    temperature: Temperature = None,
    points: Grid = 60,
) -> BaselineOut:
    """The baseline of a series: expected values over amplitude with their band, at a temperature.

    In the band an event's value lies with 95 %. CSV has the curve alone.
    """
    with sessions() as session:
        building, _ = building_queries.building(session, code)
        series = queries.one_series(session, building.id, quantity, subject)
        return baseline_answer(code, series, temperature, points)


@router.get("/baseline/observations", operation_id="list_observations", **table_responses(Observations, 404))
def observations(
    code: Code,
    sessions: Reading,
    quantity: Quantity = "stiffness",
    subject: Subject = "x",
    event: AnyEvent = None,
) -> Observations:
    """The measurements of a series in order of time: the points to the baseline's curve."""
    with sessions() as session:
        building, _ = building_queries.building(session, code)
        rows = queries.observations(session, building.id, quantity, subject, event)
    return Observations(building=code, items=rows, next=None)


@router.get("/drift", operation_id="list_drift", **table_responses(Drift, 404))
def history(
    code: Code,
    sessions: Reading,
    span: EventSpan,
    quantity: AnyQuantity = None,
    subject: AnySubject = None,
    cursor: Cursor = None,
    limit: RowLimit = 5000,
) -> Drift:
    """Deviation of each event from the baseline, a row for each series, the earliest event first."""
    with sessions() as session:
        building, _ = building_queries.building(session, code)
        rows = queries.values(session, building.id, span, quantity, subject, place(cursor), limit)
    return page_by_event(Drift, rows, limit, building=code)


@router.get("/drift-alarms", operation_id="list_drift_alarms", **table_responses(DriftAlarms, 404))
def alarms(code: Code, sessions: Reading) -> DriftAlarms:
    """Alarms in the building's series with their evidence; its alerts come from these."""
    with sessions() as session:
        building, _ = building_queries.building(session, code)
        rows = queries.alarm_rows(session, building.id)
    return DriftAlarms(building=code, items=rows, next=None)


@router.get("/reference-periods", operation_id="list_reference_periods", **table_responses(ReferencePeriods, 404))
def periods(code: Code, sessions: Reading) -> ReferencePeriods:
    """Reference periods set by engineers, the latest first.

    Of those that name a series, its quantity, or all, the one set last holds. Without any it is the first events,
    until the curve is determined.
    """
    with sessions() as session:
        building, _ = building_queries.building(session, code)
        rows = [
            ReferencePeriodOut.model_validate(one)
            for one in analysis_history.reference_periods(session, building.id)[::-1]
        ]
    return ReferencePeriods(building=code, items=rows, next=None)


@router.post(
    "/reference-periods",
    operation_id="set_reference_period",
    status_code=201,
    response_model=ReferencePeriodOut,
    responses=making(201),
)
def begin(
    code: Code,
    sessions: Writing,
    response: Response,
    by: By,
    wanted: Annotated[ReferencePeriodRequest, Body(description="Quantity, subject, start, end, and why.")],
) -> ReferencePeriodOut:
    """Set a reference period, such as from a repair on; the series are then compared with it.

    Earlier ones are kept.
    """
    with sessions.begin() as session:
        building, _ = building_queries.building(session, code)
        made = reference_periods.begin(
            session,
            building,
            wanted.quantity,
            wanted.subject,
            wanted.start,
            wanted.end,
            wanted.reason,
            by.name,
            datetime.now(UTC),
        )
        answer = ReferencePeriodOut.model_validate(made)
    response.headers["Location"] = f"/api/v1/buildings/{code}/reference-periods"
    return answer
