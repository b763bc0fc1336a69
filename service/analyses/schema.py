"""Events and analyses in the API, and the request for another analysis."""

from datetime import datetime
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, Strict, WithJsonSchema

from core.estimators import ESTIMATORS
from core.isolation_layer.motion import Integral
from core.record import Severity
from service.schema import Answer, Number, Page
from service.verdict.schema import VerdictOut


class FindingOut(Answer):
    """A data quality finding."""

    kind: str = Field(description="Kind of the finding.")
    severity: Severity = Field(description="`fatal`: the channel or event could not be used.")
    message: str = Field(description="The finding and its remedy.")
    channel: str | None = Field(description="Id of the channel; null where it concerns more than one.")
    value: Number | None = Field(description="Measure of the finding, in the message's unit; null where there is none.")


class PeakOut(Answer):
    """Largest absolute value of a channel, its mean removed."""

    channel: str = Field(description="Id of the channel.")
    level: str | None = Field(description="Null where the building file no longer has the channel.")
    quantity: str | None = Field(description="Measured quantity; null where not known.")
    direction: str | None = Field(description="x, y or z; null where not known or without one.")
    peak: Number | None = Field(description="m/s², m/s, m or °C, by quantity; null if the channel has no numbers.")


class SensorOut(Answer):
    """State of a channel in the event."""

    channel: str = Field(description="Id of the channel.")
    noise: Number | None = Field(
        description="m/s², m/s or m, standard deviation in the quietest fifth of the record; null where that is too "
        "short."
    )
    gain: Number | None = Field(
        description="Ratio to the other sensors of its direction, 1 if they agree; null where it cannot be determined."
    )
    gain_std: Number | None = Field(description="Null where the gain is null.")


class ModeOut(Answer):
    """A fixed-base mode of the superstructure."""

    number: int = Field(description="From 1, the lowest frequency.")
    frequency: Number = Field(description="Hz.")
    frequency_std: Number | None = Field(description="Hz; null where the estimator gives none.")
    damping_ratio: Number = Field(description="Part of critical damping.")
    damping_ratio_std: Number | None = Field(description="Null where the estimator gives none.")
    shape: dict[str, float] = Field(description="By level, relative to the base slab.")
    shape_std: dict[str, float] | None = Field(
        description="By level; null where noise in the base slab's record could not be considered."
    )
    misfit: Number | None = Field(
        description="Chi-square per degree of freedom of the fit with noise in every channel: 1 where noise explains "
        "the whole residual. Null without a fit."
    )


class AssessmentOut(Answer):
    """Reliability of a force's estimate: its assumptions, checked against the record."""

    assumption: str = Field(description="Assumptions on superstructure and sensors.")
    chi_square: Number | None = Field(
        description="Per degree of freedom, of noise alone: about 1 where a superstructure explains the record; null "
        "where none was needed or found."
    )
    is_at_rest: bool = Field(description="True if the record begins and ends at rest.")
    prior_share: Number = Field(
        description="Share of the prior in the storeys' stiffness: 0 if all comes from the record, 1 if all is prior."
    )
    fallback: str | None = Field(description="Why the force is another estimator's; null if it is its own.")


class DirectionOut(Answer):
    """Results in one direction."""

    direction: str = Field(description="x or y, as the building file names it.")
    peak_force: Number = Field(description="N, largest absolute restoring force.")
    force_std: Number = Field(description="N, standard deviation of the force at its peak.")
    assessment: AssessmentOut | None = Field(description="Null of an estimator that does not judge itself.")
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
    """Results for the isolation layer across the directions."""

    peak_resultant: Number | None = Field(
        description="m, largest displacement in plan; null unless the displacement is known in x and y."
    )
    peak_torsion: Number | None = Field(description="rad; null if the sensors' positions do not determine it.")
    peak_torsion_std: Number | None = Field(description="rad; null where there is no torsion.")
    torsion_lowest_frequency: Number | None = Field(
        description="Hz, from which on the torsion is good: 0 where transducers measured it; null without torsion."
    )
    axial_load_level: str | None = Field(
        description="Level whose vertical acceleration the axial load is from; null where there is none."
    )
    lowest_axial_load: Number | None = Field(description="Vertical force on the isolators over the weight.")
    highest_axial_load: Number | None = Field(description="Vertical force on the isolators over the weight.")


class FloorAccelerationOut(Answer):
    """Largest acceleration of the base slab or of a floor in one direction."""

    level: str = Field(description="Name of the level.")
    direction: str = Field(description="x or y.")
    peak: Number = Field(description="m/s², absolute.")
    std: Number | None = Field(description="m/s², standard deviation; null where it is not known.")
    is_measured: bool = Field(description="False if it is estimated from the levels that are measured.")


class StoreyDisplacementOut(Answer):
    """Largest displacement of a floor relative to the level below it in one direction."""

    level: str = Field(description="The floor above the storey.")
    direction: str = Field(description="x or y.")
    peak: Number = Field(description="m.")
    std: Number | None = Field(description="m, standard deviation; null where it is not known.")


class ShakingOut(Answer):
    """Strength of the earthquake at the lowest level with an accelerometer, and peaks of the building above it."""

    level: str = Field(description="Name of that level.")
    is_below_isolators: bool = Field(description="False where the ground is not measured; isolators reduce shaking.")
    components: list[str] = Field(description="Directions that were recorded: x, y, z.")
    pga: Number = Field(description="m/s², largest horizontal acceleration.")
    pgv: Number = Field(description="m/s, largest horizontal velocity, without what is slower than 20 s.")
    intensity: Number | None = Field(description="JMA instrumental intensity, unofficial; null without motion.")
    long_period_velocity: Number = Field(
        description="m/s, largest absolute velocity of oscillators of 1.6 to 7.8 s, 5 % damping."
    )
    long_period_class: int = Field(description="Class of long-period motion by that velocity, 0 to 4, unofficial.")
    arias: Number = Field(description="m/s, Arias intensity of the stronger horizontal component.")
    duration: Number = Field(description="s, in which the Arias intensity rises from 5 to 95 %.")
    periods: list[Number] = Field(description="s, of the spectrum.")
    spectrum: dict[str, list[Number]] = Field(
        description="m/s² by direction: pseudo-acceleration at each period, 5 % damping."
    )
    floors: list[FloorAccelerationOut] = Field(description="From the base slab up, by direction.")
    storeys: list[StoreyDisplacementOut] = Field(
        description="From the lowest up, by direction; empty where nothing describes the superstructure."
    )


class Provenance(Answer):
    """Inputs of an analysis, with which it can be repeated."""

    id: int = Field(description="Its number.")
    current: bool = Field(description="True for the event's latest analysis.")
    created_at: datetime = Field(description="Time of the analysis.")
    version: str = Field(description="Version of the code.")
    revision_id: int = Field(description="Number of the building's description.")
    estimator: str | None = Field(description="Name of the estimator; null where none was used.")
    settings: dict[str, Any] = Field(description="Estimator, sensors, rate (Hz) and band (Hz).")
    inputs: list[str] = Field(description="SHA-256 of every recording it was made from.")
    refusal: str | None = Field(description="Why the event was rejected; null if it was not.")


class EventRow(Answer):
    """An event in a list."""

    id: int = Field(description="Its number.")
    start: datetime = Field(description="Time of the first sample.")
    end: datetime = Field(description="Time of the last sample.")
    state: str = Field(description="`gathering`, `queued`, `analysed`, `refused` or `failed`.")
    reason: str | None = Field(description="Why it was refused or failed.")
    pga: Number | None = Field(description="m/s²; null before the analysis, or where the ground is not measured.")
    analysis: int | None = Field(description="Number of the latest analysis; null before the first.")


class Events(Page[EventRow]):
    """A page of events, the latest first."""


class WaveformOut(Answer):
    """An unbroken piece of a channel."""

    channel: str = Field(description="Id of the channel.")
    start: datetime = Field(description="Time of the first sample.")
    rate: Number = Field(description="Hz.")
    count: int = Field(description="Number of samples.")


class EventHead(Answer):
    """An event, its records and the analyses of it."""

    id: int = Field(description="Its number.")
    building: str = Field(description="Code of the building.")
    start: datetime = Field(description="Time of the first sample.")
    end: datetime = Field(description="Time of the last sample.")
    state: str = Field(description="`gathering`, `queued`, `analysed`, `refused` or `failed`.")
    reason: str | None = Field(description="Why it was refused or failed; null where it was not.")
    waveforms: list[WaveformOut] = Field(description="The pieces of its channels.")
    analysis: Provenance | None = Field(description="The analysis that is shown; null before the first.")
    earlier: list[Provenance] = Field(description="The other analyses.")


class Results(Answer):
    """Results of an analysis, the same in the API and in the file of `menshin analyse`."""

    pga: Number | None = Field(description="m/s², largest horizontal ground acceleration; null where not known.")
    temperature: Number | None = Field(description="°C, mean of its thermometers; null where nothing measured it.")
    verdict: VerdictOut = Field(
        description="On the earthquake, by its latest analysis and the alerts that are open now."
    )
    quality: list[FindingOut] = Field(description="Data quality findings.")
    peaks: list[PeakOut] = Field(description="Of every channel.")
    sensors: list[SensorOut] = Field(description="Of every channel that could be used.")
    directions: list[DirectionOut] = Field(description="Empty before the analysis, or where it was refused.")
    layer: LayerOut | None = Field(description="Null where nothing is known across the directions.")
    shaking: ShakingOut | None = Field(
        description="Null where no horizontal acceleration was recorded, or by an analysis of an earlier version."
    )


class EventOut(Results, EventHead):
    """An event and its results."""


class FileHead(Answer):
    """An event that was analysed from files."""

    building: str = Field(description="Code of the building.")
    start: datetime = Field(description="Time of the first sample.")
    rate: Number = Field(description="Hz, of the histories.")
    version: str = Field(description="Version of the code.")
    estimator: str | None = Field(description="Name of the estimator; null where none was used.")
    settings: dict[str, Any] = Field(description="Estimator, sensors, rate (Hz) and band (Hz).")
    refusal: str | None = Field(description="Why the event was rejected; null if it was not.")


class CycleOut(Answer):
    """The layer as a spring and a dashpot over one cycle (paper, eq 24-27); null where the record leaves it open."""

    direction: str = Field(description="x or y, as the building file names it.")
    start: Number = Field(description="s after the event's start.")
    end: Number = Field(description="s after the event's start.")
    amplitude: Number = Field(description="m.")
    shear_strain: Number | None = Field(description="amplitude / rubber height; null where the height is not given.")
    k_eq: Number | None = Field(description="N/m.")
    k_eq_std: Number | None = Field(description="N/m.")
    c_eq: Number | None = Field(description="N s/m.")
    c_eq_std: Number | None = Field(description="N s/m.")


class FileResults(Results, FileHead):
    """The file of `menshin analyse`: an event that was analysed from files, with all cycles."""

    estimators: dict[str, str] = Field(
        description="Estimator that the force is from, by direction; it may be simpler than the requested one."
    )
    cycles: list[CycleOut] = Field(description="By direction and time; in the API `/buildings/{code}/cycles`.")
    missing: dict[str, str] = Field(description="Reason of every null, by its path.")


def known_estimator(name: str) -> str:
    """The name of an existing estimator."""
    if name not in ESTIMATORS:
        raise ValueError(f"there is no estimator {name!r}; there are {', '.join(sorted(ESTIMATORS))}")
    return name


EstimatorName = Annotated[
    str, AfterValidator(known_estimator), WithJsonSchema({"type": "string", "enum": sorted(ESTIMATORS)})
]
Band = Annotated[
    tuple[Annotated[float, Field(gt=0, lt=5)], Annotated[float, Field(ge=5, le=500)]],
    Strict(False),  # JSON has no tuples
]


class AnalysisRequest(BaseModel):
    """Settings of an analysis that differ from the service's settings."""

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
    integral: Integral | None = Field(
        None,
        description="Motion from a displacement channel that was integrated from accelerations: as recorded, or with "
        "the slow motion restored that its high-pass removed.",
        examples=["restored"],
    )
