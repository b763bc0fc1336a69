"""Long series of an event, as the API answers them."""

from datetime import datetime

from pydantic import Field

from service.schema import Answer, Number, Series


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
