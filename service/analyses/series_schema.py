"""Series in the API: histories of an event, and cycles and modes over the years."""

from datetime import datetime

from pydantic import Field

from service.schema import Answer, Number, Page, Series


class Piece(Answer):
    """Samples of an unbroken piece of a channel."""

    start: datetime = Field(description="Time of the first sample.")
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
    estimator: str | None = Field(description="Name of the estimator; null where none was used.")
    start: datetime = Field(description="Time of the first sample.")
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
    start: datetime = Field(description="Time of the first sample.")
    rate: Number = Field(description="Hz.")
    step: Number = Field(description="s between samples.")
    count: int = Field(description="Number of samples before thinning.")
    time: Series | None = Field(description="s after `start`, where thinned; else null: sample i is at i · step.")
    displacement_x: Series | None = Field(None, description="m; null where nothing measures it.")
    displacement_y: Series | None = Field(None, description="m; null where nothing measures it.")
    torsion: Series | None = Field(None, description="rad; null if the sensors' positions do not determine it.")
    torsion_std: Series | None = Field(None, description="rad, standard deviation of the torsion.")
    axial_load: Series | None = Field(
        None, description="Vertical force on the isolators over the weight; null where nothing measures it."
    )
    axial_load_level: str | None = Field(description="Level whose vertical acceleration the axial load is from.")


class CycleRow(Answer):
    """The layer as a spring and a dashpot over one cycle (paper, eq 24-27)."""

    event: int = Field(description="Number of the event.")
    event_start: datetime = Field(description="Time of the event's first sample.")
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


class Cycles(Page[CycleRow]):
    """A page of cycles, the earliest first."""

    building: str = Field(description="Code of the building.")


class ModeRow(Answer):
    """A fixed-base mode of the superstructure in one event."""

    event: int = Field(description="Number of the event.")
    event_start: datetime = Field(description="Time of the event's first sample.")
    direction: str = Field(description="x or y, as the building file names it.")
    number: int = Field(description="From 1, the lowest frequency.")
    frequency: Number = Field(description="Hz.")
    frequency_std: Number | None = Field(description="Hz; null where the estimator gives none.")
    damping_ratio: Number = Field(description="Part of critical damping.")
    damping_ratio_std: Number | None = Field(description="Null where the estimator gives none.")


class Modes(Page[ModeRow]):
    """A page of modes, the earliest first."""

    building: str = Field(description="Code of the building.")


class SightingOut(Answer):
    """A mode in one event."""

    event: int = Field(description="Number of the event.")
    event_start: datetime = Field(description="Time of the event's first sample.")
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
    established: bool = Field(description="True if it was identified often enough to be a mode of the building.")
    frequency: Number = Field(description="Hz, the median.")
    damping_ratio: Number = Field(description="Part of critical damping, the median.")
    events: list[SightingOut] = Field(description="Events in which it was identified, the earliest first.")


class Tracks(Answer):
    """The modes of a building over its events."""

    building: str = Field(description="Code of the building.")
    items: list[TrackOut] = Field(description="By direction and frequency.")
