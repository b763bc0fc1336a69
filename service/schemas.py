"""What the API answers: names, units and meaning of every value. SI units, UTC times; what is missing is null."""

from datetime import datetime
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, Strict, WithJsonSchema

from core.estimators import ESTIMATORS
from core.quality import Severity
from core.record import Direction, Quantity

Number = Annotated[float, Field(allow_inf_nan=False)]
Series = list[float | None]


class Answer(BaseModel):
    """Read from a row, and nothing else comes with it."""

    model_config = ConfigDict(from_attributes=True, extra="forbid")


class Problem(BaseModel):
    """What went wrong (RFC 9457)."""

    type: str = Field(description="Always about:blank: the status says it.", examples=["about:blank"])
    title: str = Field(description="The status in words.", examples=["Not Found"])
    status: int = Field(description="HTTP status.", examples=[404])
    detail: str = Field(description="What was found and what would do.", examples=["There is no building 'X'."])
    errors: list[dict[str, str]] | None = Field(None, description="Per parameter: `in`, `name`, `wanted`; for 422.")


class BuildingRow(Answer):
    """A building under watch."""

    code: str = Field(description="Short name, as addresses have it.")
    name: str = Field(description="As the building file gives it.")
    events: int = Field(description="Number of events so far.")
    last_event: datetime | None = Field(description="Start of the latest event; null before the first.")


class Buildings(Answer):
    """All buildings under watch."""

    items: list[BuildingRow] = Field(description="The rows of this page.")
    next: str | None = Field(description="Cursor of the next page; null after the last.")


class LevelOut(Answer):
    """A level, as the building file gives it."""

    name: str = Field(description="As the building file gives it.")
    role: str = Field(description="`ground`, `base` or `floor`.")
    mass: Number | None = Field(description="kg; null where the file gives none.")
    stiffness: Number | None = Field(description="N/m, design value of the storey below; null where not given.")


class ChannelOut(Answer):
    """A sensor component, as the building file gives it."""

    id: str = Field(description="Network, station, location and channel code.")
    level: str = Field(description="Name of the level it sits on.")
    quantity: Quantity = Field(description="acceleration (m/s²), velocity (m/s), displacement (m) or temperature (°C).")
    direction: Direction | None = Field(description="Null for a temperature.")
    position: tuple[Number, Number] | None = Field(
        description="m, x and y of the sensor from its level's centre of mass; null where not given."
    )
    rotation: Number = Field(description="rad, by which its axes are turned against the building's, from x towards y.")


class BuildingOut(Answer):
    """A building and its description in force."""

    code: str = Field(description="Short name, as addresses have it.")
    name: str = Field(description="As the building file gives it.")
    revision: int = Field(description="Number of the description; each update makes a new one.")
    revised_at: datetime = Field(description="When the description came into force.")
    rubber_height: Number | None = Field(description="m, displacement of 100 % shear strain; null where not given.")
    latitude: Number | None = Field(description="°; null where not given.")
    longitude: Number | None = Field(description="°; null where not given.")
    timezone: str = Field(description="IANA name.")
    levels: list[LevelOut] = Field(description="From the ground up.")
    channels: list[ChannelOut] = Field(description="The sensors.")


class EventRow(Answer):
    """An event in a list."""

    id: int = Field(description="Its number.")
    start: datetime = Field(description="Of the first sample.")
    end: datetime = Field(description="Of the last sample.")
    state: str = Field(description="`gathering`, `queued`, `analysed`, `refused` or `failed`.")
    reason: str | None = Field(description="Why it was refused or failed.")
    pga: Number | None = Field(description="m/s²; null before the analysis, or where the ground is not measured.")
    analysis: int | None = Field(description="Number of the latest analysis; null before the first.")


class Events(Answer):
    """A page of events, the latest first."""

    items: list[EventRow] = Field(description="The rows of this page.")
    next: str | None = Field(description="Cursor of the next page; null after the last.")


class FindingOut(Answer):
    """What screening found."""

    kind: str = Field(description="Of which kind it is.")
    severity: Severity = Field(description="`fatal`: what it concerns could not be used.")
    message: str = Field(description="What was found and what would do.")
    channel: str | None = Field(description="Id of the channel; null where it concerns more than one.")
    value: Number | None = Field(description="The measure of it, in the unit that the message gives; null where none.")


class PeakOut(Answer):
    """Largest absolute value of a channel, its mean removed."""

    channel: str = Field(description="Id of the channel.")
    level: str | None = Field(description="Null where the building file no longer has the channel.")
    quantity: str | None = Field(description="What it measures; null where not known.")
    direction: str | None = Field(description="x, y or z; null where not known or without one.")
    peak: Number | None = Field(description="m/s², m/s, m or °C, by quantity; null where the channel held no number.")


class ModeOut(Answer):
    """A fixed-base mode of the superstructure."""

    number: int = Field(description="From 1, the lowest frequency.")
    frequency: Number = Field(description="Hz.")
    frequency_std: Number | None = Field(description="Hz; null where the estimator gives none.")
    damping_ratio: Number = Field(description="Part of critical damping.")
    damping_ratio_std: Number | None = Field(description="Null where the estimator gives none.")
    shape: dict[str, float] = Field(description="By level, relative to the base slab.")
    shape_std: dict[str, float] | None = Field(
        description="By level; null where noise of the base slab's record could not be allowed for."
    )
    misfit: Number | None = Field(
        description="Chi-square per degree of freedom of the fit that allows for noise in every channel: 1 where noise "
        "explains all it leaves. Null where there was none."
    )


class RelianceOut(Answer):
    """How far the assumptions of a force's estimate held."""

    assumption: str = Field(description="What the record asked to be assumed of superstructure and sensors.")
    chi_square: Number | None = Field(
        description="Per degree of freedom, of noise alone: about 1 where a superstructure explains the record; null "
        "where none was needed or found."
    )
    is_at_rest: bool = Field(description="Whether the record begins and ends at rest.")
    prior_share: Number = Field(
        description="Of what is known of the storeys' stiffness: 0 if all is from the record, 1 if all was believed."
    )
    fallback: str | None = Field(description="Why the force is another estimator's; null if it is its own.")


class DirectionOut(Answer):
    """What was found in a direction."""

    direction: str = Field(description="x or y, as the building file names it.")
    peak_force: Number = Field(description="N, largest absolute restoring force.")
    force_std: Number = Field(description="N, its standard deviation.")
    reliance: RelianceOut | None = Field(description="Null of an estimator that does not judge itself.")
    peak_displacement: Number | None = Field(description="m; null where nothing measures the layer's displacement.")
    peak_displacement_std: Number | None = Field(description="m; null where there is no peak displacement.")
    lowest_frequency: Number | None = Field(
        description="Hz, from which on the displacement is good: 0 where a transducer measured it."
    )
    highest_frequency: Number | None = Field(description="Hz, up to which the displacement is good.")
    residual_displacement: Number | None = Field(
        description="m, mean of the record's end less mean of its start; null where no transducer measured it."
    )
    residual_displacement_std: Number | None = Field(description="m; null where there is no residual displacement.")
    cycles: int = Field(description="Number of cycles with k_eq and c_eq.")
    modes: list[ModeOut] = Field(description="The lowest first.")


class LayerOut(Answer):
    """What was found of the isolation layer across the directions."""

    peak_resultant: Number | None = Field(
        description="m, farthest that it went in plan; null unless the displacement is known in x and y."
    )
    peak_torsion: Number | None = Field(description="rad; null where the sensors' positions do not tell it.")
    peak_torsion_std: Number | None = Field(description="rad; null where there is no torsion.")
    torsion_lowest_frequency: Number | None = Field(
        description="Hz, from which on the torsion is good: 0 where transducers measured it; null without torsion."
    )
    axial_load_level: str | None = Field(
        description="Level whose vertical acceleration the axial load is from; null where there is none."
    )
    lowest_axial_load: Number | None = Field(description="Vertical force on the isolators over the weight.")
    highest_axial_load: Number | None = Field(description="Vertical force on the isolators over the weight.")


class Provenance(Answer):
    """What an analysis was made from, so that it can be made again."""

    id: int = Field(description="Its number.")
    current: bool = Field(description="Whether it is the event's latest.")
    created_at: datetime = Field(description="When it was made.")
    version: str = Field(description="Of the code.")
    revision_id: int = Field(description="Of the building's description.")
    estimator: str | None = Field(description="Name of the estimator; null where it came to none.")
    settings: dict[str, Any] = Field(description="Estimator, sensors, rate (Hz) and band (Hz).")
    inputs: list[str] = Field(description="SHA-256 of every recording it was made from.")
    refusal: str | None = Field(description="Why nothing could be found.")


class WaveformOut(Answer):
    """An unbroken piece of a channel."""

    channel: str = Field(description="Id of the channel.")
    start: datetime = Field(description="Of the first sample.")
    rate: Number = Field(description="Hz.")
    count: int = Field(description="Number of samples.")


class EventOut(Answer):
    """An event and what came of it."""

    id: int = Field(description="Its number.")
    building: str = Field(description="Code of the building.")
    start: datetime = Field(description="Of the first sample.")
    end: datetime = Field(description="Of the last sample.")
    state: str = Field(description="`gathering`, `queued`, `analysed`, `refused` or `failed`.")
    reason: str | None = Field(description="Why it was refused or failed; null where it was not.")
    pga: Number | None = Field(description="m/s², largest horizontal ground acceleration; null where not known.")
    waveforms: list[WaveformOut] = Field(description="The pieces of its channels.")
    analysis: Provenance | None = Field(description="The analysis that is shown; null before the first.")
    earlier: list[Provenance] = Field(description="The other analyses.")
    quality: list[FindingOut] = Field(description="What screening found.")
    peaks: list[PeakOut] = Field(description="Of every channel.")
    directions: list[DirectionOut] = Field(description="Empty before the analysis, or where it was refused.")
    layer: LayerOut | None = Field(description="Null where nothing is known across the directions.")


class Piece(Answer):
    """Samples of an unbroken piece of a channel."""

    start: datetime = Field(description="Of the first sample.")
    rate: Number = Field(description="Hz.")
    step: Number = Field(description="s between samples.")
    count: int = Field(description="Number of samples recorded.")
    time: Series | None = Field(description="s after `start`, where thinned; else null: sample i is at i · step.")
    samples: Series = Field(description="SI units; null where the sensor gave no number.")


class WaveformSeries(Answer):
    """A channel of an event as recorded."""

    event: int = Field(description="Number of the event.")
    channel: str = Field(description="Id of the channel.")
    level: str | None = Field(description="Name of the level it sits on; null where not known.")
    quantity: str | None = Field(
        description="acceleration (m/s²), velocity (m/s), displacement (m) or temperature (°C)."
    )
    direction: str | None = Field(description="x, y or z; null where not known or without one.")
    pieces: list[Piece] = Field(description="In order of time; a gap lies between two.")
    missing: str | None = Field(description="Why samples are null; null where none is.")


class ForceSeries(Answer):
    """Motion and restoring force of the isolation layer; F > 0 where it is displaced to the + side (paper, eq 10)."""

    event: int = Field(description="Number of the event.")
    building: str = Field(description="Code of the building.")
    direction: str = Field(description="x or y, as the building file names it.")
    analysis: int = Field(description="Number of the analysis.")
    estimator: str | None = Field(description="Name of the estimator; null where it came to none.")
    start: datetime = Field(description="Of the first sample.")
    rate: Number = Field(description="Hz.")
    step: Number = Field(description="s between samples.")
    count: int = Field(description="Number of samples before thinning.")
    time: Series | None = Field(description="s after `start`, where thinned; else null: sample i is at i · step.")
    displacement: Series | None = Field(None, description="m.")
    displacement_std: Series | None = Field(None, description="m, standard deviation of the displacement.")
    velocity: Series | None = Field(None, description="m/s.")
    velocity_std: Series | None = Field(None, description="m/s, standard deviation of the velocity.")
    force: Series | None = Field(None, description="N, force_rigid + force_modal.")
    force_rigid: Series | None = Field(None, description="N, inertia of the building moving as the base slab.")
    force_modal: Series | None = Field(None, description="N, inertia of the superstructure relative to the base slab.")
    force_std: Series | None = Field(None, description="N, standard deviation of the force.")
    missing: str | None = Field(description="Why displacement and velocity are null; null where they are not.")


class LayerMotionSeries(Answer):
    """Motion of the isolation layer in plan, from x towards y, and the vertical load on it."""

    event: int = Field(description="Number of the event.")
    building: str = Field(description="Code of the building.")
    analysis: int = Field(description="Number of the analysis.")
    start: datetime = Field(description="Of the first sample.")
    rate: Number = Field(description="Hz.")
    step: Number = Field(description="s between samples.")
    count: int = Field(description="Number of samples before thinning.")
    time: Series | None = Field(description="s after `start`, where thinned; else null: sample i is at i · step.")
    displacement_x: Series | None = Field(None, description="m; null where nothing measures it.")
    displacement_y: Series | None = Field(None, description="m; null where nothing measures it.")
    torsion: Series | None = Field(None, description="rad; null where the sensors' positions do not tell it.")
    torsion_std: Series | None = Field(None, description="rad, standard deviation of the torsion.")
    axial_load: Series | None = Field(
        None, description="Vertical force on the isolators over the weight; null where nothing measures it."
    )
    axial_load_level: str | None = Field(description="Level whose vertical acceleration the axial load is from.")


class CycleRow(Answer):
    """The layer as a spring and a dashpot over one cycle (paper, eq 24-27)."""

    event: int = Field(description="Number of the event.")
    event_start: datetime = Field(description="Of the event's first sample.")
    direction: str = Field(description="x or y, as the building file names it.")
    record_start: datetime = Field(description="Time to which start and end count.")
    start: Number = Field(description="s after record_start.")
    end: Number = Field(description="s after record_start.")
    amplitude: Number = Field(description="m.")
    shear_strain: Number | None = Field(description="amplitude / rubber height; null where the height is not given.")
    k_eq: Number = Field(description="N/m.")
    k_eq_std: Number = Field(description="N/m.")
    c_eq: Number = Field(description="N s/m.")
    c_eq_std: Number = Field(description="N s/m.")


class Cycles(Answer):
    """A page of cycles, the earliest first."""

    building: str = Field(description="Code of the building.")
    items: list[CycleRow] = Field(description="The rows of this page.")
    next: str | None = Field(description="Cursor of the next page; null after the last.")


class ModeRow(Answer):
    """A fixed-base mode of the superstructure in one event."""

    event: int = Field(description="Number of the event.")
    event_start: datetime = Field(description="Of the event's first sample.")
    direction: str = Field(description="x or y, as the building file names it.")
    number: int = Field(description="From 1, the lowest frequency.")
    frequency: Number = Field(description="Hz.")
    frequency_std: Number | None = Field(description="Hz; null where the estimator gives none.")
    damping_ratio: Number = Field(description="Part of critical damping.")
    damping_ratio_std: Number | None = Field(description="Null where the estimator gives none.")


class Modes(Answer):
    """A page of modes, the earliest first."""

    building: str = Field(description="Code of the building.")
    items: list[ModeRow] = Field(description="The rows of this page.")
    next: str | None = Field(description="Cursor of the next page; null after the last.")


class SightingOut(Answer):
    """A mode in one event."""

    event: int = Field(description="Number of the event.")
    event_start: datetime = Field(description="Of the event's first sample.")
    pga: Number | None = Field(description="m/s², peak horizontal ground acceleration; null where not measured.")
    peak_force: Number = Field(description="N, largest absolute restoring force of the isolation layer.")
    peak_displacement: Number | None = Field(description="m, of the isolation layer; null where not known.")
    frequency: Number = Field(description="Hz.")
    frequency_std: Number | None = Field(description="Hz; null where the estimator gives none.")
    damping_ratio: Number = Field(description="Part of critical damping.")
    damping_ratio_std: Number | None = Field(description="Null where the estimator gives none.")
    shape: dict[str, float] = Field(description="By level, relative to the base slab.")
    shape_std: dict[str, float] | None = Field(description="By level; null where the estimator gives none.")
    misfit: Number | None = Field(description="Chi-square per degree of freedom; null without a fit.")


class TrackOut(Answer):
    """One mode of the superstructure, followed from event to event."""

    direction: str = Field(description="x or y, as the building file names it.")
    number: int = Field(description="From 1 in each direction, the lowest frequency first.")
    established: bool = Field(description="Whether it was seen often enough to be a mode of the building.")
    frequency: Number = Field(description="Hz, the median.")
    damping_ratio: Number = Field(description="Part of critical damping, the median.")
    events: list[SightingOut] = Field(description="In which it was seen, the earliest first.")


class Tracks(Answer):
    """The modes of a building over its events."""

    building: str = Field(description="Code of the building.")
    items: list[TrackOut] = Field(description="By direction and frequency.")


class SourceOut(Answer):
    """A building's monitoring server and how it is doing."""

    building: str = Field(description="Code of the building.")
    kind: str = Field(description="Of which kind it is.")
    location: str = Field(description="Without the password, if it has one.")
    attempted_at: datetime | None = Field(description="Null before the first attempt.")
    succeeded_at: datetime | None = Field(description="Null before the first success.")
    failing_since: datetime | None = Field(description="Null while it answers.")
    error: str | None = Field(description="What went wrong last; null where nothing did.")


class Sources(Answer):
    """All sources."""

    items: list[SourceOut] = Field(description="The rows of this page.")
    next: str | None = Field(description="Cursor of the next page; null after the last.")


def known_estimator(name: str) -> str:
    """The name of an estimator that there is."""
    if name not in ESTIMATORS:
        raise ValueError(f"there is no estimator {name!r}; there is {', '.join(sorted(ESTIMATORS))}")
    return name


EstimatorName = Annotated[
    str, AfterValidator(known_estimator), WithJsonSchema({"type": "string", "enum": sorted(ESTIMATORS)})
]
Band = Annotated[
    tuple[Annotated[float, Field(gt=0, lt=5)], Annotated[float, Field(ge=5, le=500)]],
    Strict(False),  # JSON has no tuples
]


class AnalysisRequest(BaseModel):
    """What shall differ from the service's settings; nothing: the settings in force."""

    model_config = ConfigDict(extra="forbid", strict=True)

    estimator: EstimatorName | None = Field(None, description="Name of an estimator.", examples=["cms"])
    sensors: list[str] | None = Field(
        None,
        min_length=2,
        max_length=200,
        description="Levels to use, by name or as `base` and `roof`; the base slab must be among them.",
        examples=[["base", "roof"]],
    )
    rate: float | None = Field(
        None, ge=20, le=1000, description="Hz, to which records are resampled.", examples=[100.0]
    )
    band: Band | None = Field(
        None,
        description="Hz, pass band: its low end, below 5, and its high end, which lies below half the rate.",
        examples=[[0.1, 30.0]],
    )


class JobOut(Answer):
    """An analysis that waits, runs, is done or has failed."""

    id: int = Field(description="Its number.")
    kind: str = Field(description="Of which kind it is.")
    event_id: int = Field(description="Number of the event.")
    state: str = Field(description="`waiting`, `running`, `done` or `failed`.")
    arguments: dict[str, Any] = Field(description="What differs from the service's settings.")
    claims: int = Field(description="How often a worker took it.")
    claimed_until: datetime | None = Field(description="End of the worker's lease; null while nobody works on it.")
    error: str | None = Field(description="What went wrong last; null where nothing did.")
    created_at: datetime = Field(description="When it was made.")
    finished_at: datetime | None = Field(description="When it was done or given up; null before.")


class Jobs(Answer):
    """A page of jobs, the latest first."""

    items: list[JobOut] = Field(description="The rows of this page.")
    next: str | None = Field(description="Cursor of the next page; null after the last.")


class Health(Answer):
    """How the service is doing."""

    status: str = Field(description="`alive` or `ready`.", examples=["ready"])
