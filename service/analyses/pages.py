"""Pages of a building's earthquakes: the list, and the results of one."""

import hashlib
import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Annotated, Self

from fastapi import APIRouter, Depends, Query, Request, Response
from pydantic import BaseModel, ConfigDict, Field, model_validator
from sqlalchemy.orm import Session, sessionmaker
from starlette.responses import RedirectResponse

from core.estimators import ESTIMATORS
from core.record import Channel
from service.access.auth import Caller, Role, engineer
from service.access.pages import reader
from service.analyses import document, queries
from service.analyses.api.event_pictures import MOST_CHANNELS, ChannelName
from service.analyses.api.events import checked
from service.analyses.schema import AnalysisRequest, EstimatorName, ShakingOut
from service.analyses.tables import Analysis, DirectionResult, LayerResult
from service.buildings import queries as building_queries
from service.buildings.store import described, zone
from service.db.select import Span
from service.errors import NotFoundError
from service.http.forms import NOT_REFUSED, Posted, Refused, answered, posted
from service.http.paging import Cursor, next_place, place
from service.http.parameters import LARGEST, Code, Id, Reading, Writing
from service.http.rendering import page
from service.jobs import queue as job_queue
from service.models import answers, queries as model_queries
from service.models.choice import Chosen, chosen
from service.models.queries import DIRECTIONS
from service.models.schema import ComparisonRow
from service.models.tables import ModelVersion
from service.records import originals, queries as record_queries
from service.records.tables import Event
from service.verdict import reading

STATES = {
    "gathering": "Its files are still coming in",
    "queued": "It waits for its analysis",
    "analysed": "",
    "refused": "It could not be used",
    "failed": "Its analysis failed",
}
"""Description of an event's state; the reason follows."""
MODES = 3
"""Modes that a page lists."""
LISTED = 100
"""Earthquakes of one page."""

OFFERED = 50
"""Earthquakes that a page offers to compare with, the latest."""


class AnalysisForm(BaseModel):
    """Settings of another analysis, as the page's form sends them; what is left empty stays as it is."""

    model_config = ConfigDict(extra="ignore")

    estimator: EstimatorName | None = None
    low: Annotated[float, Field(gt=0, lt=5, allow_inf_nan=False)] | None = None
    high: Annotated[float, Field(ge=5, le=500, allow_inf_nan=False)] | None = None
    rate: Annotated[float, Field(ge=20, le=1000, allow_inf_nan=False)] | None = None

    @model_validator(mode="after")
    def _both_ends(self) -> Self:
        if (self.low is None) != (self.high is None):
            raise ValueError("the band needs both ends")
        return self

    def request(self) -> AnalysisRequest:
        """The settings that differ."""
        band = None if self.low is None or self.high is None else (self.low, self.high)
        return AnalysisRequest(estimator=self.estimator, sensors=None, rate=self.rate, band=band, integral=None)


router = APIRouter(include_in_schema=False, dependencies=[Depends(reader)])
By = Annotated[Caller, Depends(reader)]
Engineer = Annotated[Caller, Depends(engineer)]
Again = Annotated[Posted[AnalysisForm], Depends(posted(AnalysisForm))]


@dataclass(frozen=True, slots=True)
class View:
    """An event as a page shows it."""

    event: Event
    state: str
    """In words; empty where there are results."""
    analysis: Analysis | None
    results: Sequence[DirectionResult]
    layer: LayerResult | None
    """Results across the directions."""
    shaking: ShakingOut | None
    """None by an analysis of an earlier version."""
    deleted: Mapping[str, tuple[datetime, str | None]]
    """When and by which setting original files that it was made from were deleted, by their SHA-256."""


@dataclass(frozen=True, slots=True)
class EventLine:
    """An event as a line of the list of all."""

    event: Event
    state: str
    """As in View."""
    pga: float | None
    """m/s²."""
    displacements: Mapping[str, float | None]
    """m, largest of the isolation layer, by direction."""
    forces: Mapping[str, float | None]
    """N."""


@dataclass(frozen=True, slots=True)
class CurrentModel:
    """A current model at an earthquake, and the earthquakes that its diagnosis would work with."""

    version: ModelVersion
    comparisons: Sequence[ComparisonRow]
    """Errors in this earthquake, by direction; none as long as it was not compared."""
    choice: Sequence[Chosen]
    """Empty where this earthquake has no motion of the layer in the model's directions."""


@dataclass(frozen=True, slots=True)
class ChannelChoice:
    """A channel that the page offers to show."""

    id: str
    is_shown: bool
    sensor: Channel | None
    """As the building file describes it."""


@dataclass(frozen=True, slots=True)
class Beside:
    """Another earthquake of the building to compare with."""

    event: Event
    results: Mapping[str, DirectionResult]
    """By direction."""
    has_spectrum: bool


@router.get("/events/{event_id}")
def of_event(
    request: Request,
    event_id: Id,
    sessions: Reading,
    by: By,
    channel: Annotated[list[ChannelName] | None, Query(max_length=MOST_CHANNELS)] = None,
    other: Annotated[int | None, Query(ge=1, le=LARGEST)] = None,
) -> Response:
    """One earthquake and its results, with links to the ones before and after it.

    `channel` has the channels to show; `other` is the number of an earthquake to compare with.
    """
    return _shown_event(request, event_id, sessions, by, channel, other)


def _shown_event(
    request: Request,
    event_id: int,
    sessions: sessionmaker[Session],
    by: Caller,
    channels: Collection[str] | None = None,
    other: int | None = None,
    refused: Refused = NOT_REFUSED,
) -> Response:
    """The page of an earthquake; of a form that was refused it says why."""
    with sessions() as session:
        event, analysis = record_queries.event_with_analysis(session, event_id)
        before, after = record_queries.neighbours(session, event)
        current = model_queries.current_versions(session, event.building_id)
        return page(
            request,
            "event",
            refused.status,
            refused=refused,
            view=viewed(session, event, analysis),
            zone=zone(session, event.building),
            verdict_on=reading.of_event(session, event),
            ended=reading.ended_alerts(session, event),
            modes=MODES,
            models=[_current(session, event, one) for one in current],
            may_work=by.on(event.building.code).role >= Role.engineer,
            channels=_channels(session, event, channels),
            others=_others(session, event) if analysis else [],
            beside=None if other is None else _beside(session, event, other),
            settings_digest=_digest(analysis) if analysis else None,
            estimators=sorted(ESTIMATORS),
            own=request.app.state.settings.analysis,
            before=before,
            after=after,
        )


@router.post("/events/{event_id}/analyses")
def analyse(request: Request, event_id: Id, sessions: Writing, by: Engineer, form: Again) -> Response:
    """Analyse an earthquake again with other settings, and show the progress."""

    def act(wanted: AnalysisForm) -> Response:
        with sessions.begin() as session:
            event = record_queries.event(session, event_id)
            description = described(session, event.building).description
            arguments = checked(wanted.request(), description, request.app.state.settings)
            number = job_queue.enqueue(session, event, arguments, datetime.now(UTC), by.name).id
        return RedirectResponse(f"/jobs/{number}", 303)

    return answered("again", form, act, lambda why: _shown_event(request, event_id, sessions, by, refused=why))


@router.get("/buildings/{code}/events")
def of_building(request: Request, code: Code, sessions: Reading, cursor: Cursor = None) -> Response:
    """The building's earthquakes, the latest first."""
    with sessions() as session:
        building, _ = building_queries.building(session, code)
        pairs = record_queries.events(session, building.id, Span(), None, place(cursor), LISTED)
        peaks = queries.peaks(session, [analysis.id for _, analysis in pairs if analysis])
        directions = sorted({direction for _, direction in peaks})
        return page(
            request,
            "events",
            building=building,
            zone=zone(session, building),
            rows=[_line(event, analysis, peaks, directions) for event, analysis in pairs],
            directions=directions,
            is_later=cursor is not None,
            following=next_place([(event.start, event.id) for event, _ in pairs], LISTED),
        )


def _current(session: Session, event: Event, version: ModelVersion) -> CurrentModel:
    moved = model_queries.moved(session, event.building_id, DIRECTIONS[version.direction])
    compared = model_queries.of_event(session, version.id, event.id)
    choice = chosen(moved, event.id) if any(one.event == event.id for one in moved) else ()
    return CurrentModel(version, [answers.comparison_row(one, event) for one in compared], choice)


def _channels(session: Session, event: Event, shown: Collection[str] | None) -> list[ChannelChoice]:
    """The event's channels; where none is chosen, the lowest and the highest accelerations in one direction are."""
    known = {one.id: one for one in described(session, event.building).description.channels}
    names = list(dict.fromkeys(one.channel for one in record_queries.event(session, event.id).waveforms))
    levels = [one for one in names if one in known and known[one].quantity == "acceleration"]
    along = [one for one in levels if known[one].direction == known[levels[0]].direction]
    ticked = set(shown if shown is not None else [*along[:1], *along[-1:]] or names[:1])
    return [ChannelChoice(one, one in ticked, known.get(one)) for one in sorted(names)]


def _others(session: Session, event: Event) -> list[Event]:
    """Earthquakes to compare with: those around it in time are as likely as the strongest."""
    pairs = record_queries.events(session, event.building_id, Span(), None, None, OFFERED)
    return [one for one, analysis in pairs if analysis is not None and one.id != event.id]


def _beside(session: Session, event: Event, number: int) -> Beside:
    other, analysis = record_queries.event_with_analysis(session, number)
    if other.building_id != event.building_id:
        raise NotFoundError("earthquake of this building", number)
    view = viewed(session, other, analysis)
    results = {one.direction: one for one in view.results if one.peak_displacement is not None}
    return Beside(other, results, view.shaking is not None)


def _digest(analysis: Analysis) -> str:
    """Digest of the settings of an analysis: equal for equal settings."""
    written = json.dumps(analysis.settings, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(written.encode()).hexdigest()[:12]


def viewed(session: Session, event: Event, analysis: Analysis | None) -> View:
    """An event with the results of its latest analysis."""
    results = queries.direction_results(session, analysis.id) if analysis else []
    layer = queries.layer_result(session, analysis.id) if analysis else None
    shaking = document.shaking_out(queries.shaking_result(session, analysis.id)) if analysis else None
    deleted = originals.deletions(session, analysis.inputs) if analysis else {}
    return View(event, STATES.get(event.state, event.state), analysis, results, layer, shaking, deleted)


def _line(
    event: Event,
    analysis: Analysis | None,
    peaks: Mapping[tuple[int, str], tuple[float | None, float]],
    directions: Sequence[str],
) -> EventLine:
    own = {direction: peaks.get((analysis.id if analysis else 0, direction), (None, None)) for direction in directions}
    return EventLine(
        event,
        STATES.get(event.state, event.state),
        analysis.pga if analysis else None,
        {direction: displacement for direction, (displacement, _) in own.items()},
        {direction: force for direction, (_, force) in own.items()},
    )
