"""Results of the workbench: one schema for the command's files, the stored rows, the API and the pages.

SI units; null for a value that is not known or has no bound.
"""

from collections.abc import Mapping
from math import isfinite
from typing import Annotated, Any

from pydantic import AliasChoices, BaseModel, BeforeValidator, ConfigDict, Field

from core.comparison.block_corrections import BlockCorrection
from core.comparison.excess import Share
from core.comparison.failure import Window
from core.comparison.misfit import Misfit
from core.effects import EFFECTS
from core.workbench.candidates import Candidate
from service.models.model_file import ModelFile
from service.schema import Number, json_values
from service.version import VERSION


def _finite(value: object) -> object:
    return None if isinstance(value, float) and not isfinite(value) else value


Value = Annotated[Number | None, BeforeValidator(_finite)]
NoiseRatio = Annotated[Value, Field(validation_alias=AliasChoices("noise_ratio", "in_noise_floors"))]
HeldOut = Annotated[bool, Field(validation_alias=AliasChoices("held_out", "left_out"))]
"""RMS of an error in multiples of that of a correct model; earlier versions stored it by another name."""


class Result(BaseModel):
    """A result or a part of one; rows that another version of the code stored may have more fields."""

    model_config = ConfigDict(extra="ignore", from_attributes=True)


class MisfitOut(Result):
    """Error of a model over some events together."""

    rms: Value = Field(description="N; of a displacement m, of an acceleration m/s².")
    nrmse: Value = Field(description="RMS of the error over RMS of the measured value.")
    fitting_rate: Value = Field(description="%, as the paper defines it.")
    noise_floor: Value = Field(description="RMS of the error of a correct model, in the unit of `rms`.")
    noise_ratio: NoiseRatio = Field(description="RMS of the error in multiples of the floor.")

    @classmethod
    def of(cls, misfit: Misfit) -> "MisfitOut":
        """The measures of a misfit."""
        return cls(
            rms=misfit.rms,
            nrmse=misfit.nrmse,
            fitting_rate=misfit.fitting_rate,
            noise_floor=misfit.floor,
            noise_ratio=misfit.noise_ratio,
        )


class PredictionOut(Result):
    """Errors of the response that model and superstructure predict from the ground motion alone."""

    displacement: MisfitOut = Field(description="Error of the isolation layer's displacement.")
    accelerations: dict[str, MisfitOut] = Field(description="Errors of the floors' accelerations, by level.")


class EventErrors(Result):
    """Errors of a model in one earthquake and direction."""

    name: str = Field(description="Name of the earthquake.")
    start: str = Field(description="Time of its first sample.")
    direction: str = Field(description="x or y.")
    held_out: HeldOut = Field(description="True if the earthquake was held out.")
    force: MisfitOut = Field(description="Error of the force, driven by the measured motion.")
    prediction: PredictionOut | None = Field(description="Null where nothing measured the ground.")


class ModelValues(Result):
    """A model: direction, effects and values."""

    direction: str = Field(description="x, y or xy.")
    parent: str | None = Field(description="Name of the model that it was made from.")
    fitted_to: list[str] = Field(description="Names of the earthquakes that its values were fitted to.")
    effects: dict[str, dict[str, Value]] = Field(description="Value of every parameter, by effect.")
    standard_deviations: dict[str, dict[str, Value]] = Field(description="Those of the fitted parameters, by effect.")

    @classmethod
    def of(cls, model: ModelFile) -> "ModelValues":
        """The content of a model file."""
        return cls(
            direction=model.direction,
            parent=model.parent,
            fitted_to=list(model.fitted_to),
            effects=_by_effect(model.isolator.effects),
            standard_deviations=_by_effect(model.standard_deviations),
        )


class Head(Result):
    """Opening of every document."""

    version: str = Field(default=VERSION, description="Version of the code.")
    building: str = Field(description="Code of the building.")


class ComparisonDocument(Head):
    """A comparison of a model with records."""

    model: ModelValues
    events: list[EventErrors] = Field(description="In order of time.")
    all: "AllErrors" = Field(description="Over all earthquakes.")
    failure: "FailureOut" = Field(description="Where the model fails.")
    corrections: list[BlockCorrection] = Field(description="Stiffness and yield force that each block of 5 s adds.")
    remarks: list[str] = Field(description="On the prediction from the ground motion.")
    unused: list[str] = Field(description="Records that could not be used, with the reason.")


class AllErrors(Result):
    """Errors over all earthquakes."""

    force: MisfitOut
    prediction: "AllPredictions | None" = Field(description="Null where nothing measured the ground.")


class AllPredictions(PredictionOut):
    """The same of the prediction from the ground motion alone."""

    all_accelerations: MisfitOut | None = Field(description="Over all floors; null without any.")


class RegionOut(Result):
    """Part of the records with more of the excess error than of the force."""

    covariate: str
    threshold: Value = Field(description="SI units; null of a class.")
    is_above: bool
    class_: str | None = Field(serialization_alias="class", description="Null of a number.")
    share: Share = Field(description="Share of the excess error, with its 95 % interval.")
    share_of_energy: Value
    odds: Share


class BinOut(Result):
    """Part of the range of a covariate."""

    class_: str | None = Field(serialization_alias="class", description="Null of a number.")
    low: Value
    high: Value
    share: Share = Field(description="Share of the excess error.")
    energy: Value = Field(description="Share of the force's energy.")
    time: Value = Field(description="Share of the samples.")
    noise_ratio: Value = Field(description="Noise ratio.")


class ProfileOut(Result):
    """The excess error over a covariate."""

    covariate: str
    explained_share: Share | None = Field(
        description="Share of the excess error that values of its own in each bin remove."
    )
    bins: list[BinOut]


class FailureOut(Result):
    """The error of a model beyond noise, and the circumstances in which it occurs."""

    explanation: str
    is_noise: bool = Field(description="True if noise explains the whole error.")
    noise_ratio: Share = Field(description="Noise ratio.")
    constant_stiffness_and_damping: Share = Field(description="Share of the excess error that they would remove.")
    any_function_of_motion: Share = Field(description="Share of the excess error that it would remove.")
    regions: list[RegionOut]
    narrowed: RegionOut | None
    profiles: list[ProfileOut]
    windows: list[Window] = Field(description="Blocks with the largest error.")


class Covariance(Result):
    """Covariance of the fitted values."""

    parameters: list[list[str]] = Field(description="Effect and parameter of each row.")
    matrix: list[list[Value]]


class FitDocument(Head):
    """A fit of a model's values."""

    model: ModelValues
    outcome: str = Field(description="Outcome of the fit.")
    undetermined: list[list[str]] = Field(description="Effect and parameter that the records do not determine.")
    covariance: Covariance
    before: list[EventErrors]
    after: list[EventErrors]
    explanation: str
    unused: list[str]


class SuspectOut(Result):
    """A fault of sensors, superstructure or mass, which comes before the isolation layer."""

    cause: str = Field(description="`sensor_fault`, `superstructure` or `mass`.")
    kind: str = Field(
        description="Kind of fault: `gain`, `storey`, ...; of the masses `mass`, their total, or `floor_share`, the "
        "floors' share of it."
    )
    channel: str | None = Field(description="Id of the channel or name of the level; null where it concerns all.")
    value: Value = Field(description="Its size, in the unit of the message.")
    std: Value = Field(description="Standard deviation; null where it has none.")
    message: str = Field(description="The problem and its remedy.")
    corrected: bool = Field(
        default=False,
        description="True if the records, or the forces, were corrected for it in a copy before the isolation layer "
        "was judged.",
    )


class FittedValue(Result):
    """A parameter of an effect that was tried."""

    value: Value = Field(description="In its unit.")
    std: Value = Field(description="Standard deviation; null where it was not fitted, or not determined.")
    unit: str = Field(description="SI.")


class CandidateOut(Result):
    """An effect that was tried: added to the model, everything fitted again."""

    effect: str = Field(description="Its name.")
    family: str = Field(description="Effects of one family leave similar traces.")
    delta_bic: Value = Field(description="The events support the effect below -10.")
    error_before: Value = Field(description="N, RMS of the force's error in the fitted events, without it.")
    error_after: Value = Field(description="The same with it.")
    error_after_held_out: Value = Field(description="The same in the held-out events; null without any.")
    noise_floor: Value = Field(description="N, RMS of the error of a correct model.")
    plausible: bool = Field(description="True if its values are physically possible.")
    reason: str | None = Field(description="Why they are not; null where they are.")
    parameters: dict[str, FittedValue] = Field(description="Parameters of the effect, by name.")

    @classmethod
    def of(cls, one: Candidate, before: Misfit) -> "CandidateOut":
        """The same of core; `before` is the misfit (N) without the effect."""
        values = one.fit.model.effects[one.effect]
        return cls(
            effect=one.effect,
            family=one.family,
            delta_bic=one.delta_bic,
            error_before=before.rms,
            error_after=one.after.rms,
            error_after_held_out=None if one.after_held_out is None else one.after_held_out.rms,
            noise_floor=one.after.floor,
            plausible=one.implausible is None,
            reason=one.implausible,
            parameters={
                known.name: FittedValue(value=values[known.name], std=one.std.get(known.name), unit=known.unit)
                for known in EFFECTS[one.effect].parameters
            },
        )


class DroppedOut(Result):
    """An effect that could not be checked."""

    effect: str = Field(description="Its name.")
    reason: str = Field(description="Why, in words.")


class StepOut(Result):
    """A missing effect, beside those of the steps before."""

    effect: str = Field(description="Its name.")
    family: str = Field(description="Its family.")
    delta_bic: Value = Field(description="BIC of the model with it less that without.")
    share: Value = Field(
        default=None, description="Share of the excess error that it takes beside the others; null if unknown."
    )
    share_held_out: Value = Field(
        default=None, description="The same in the held-out events; null without any, or if nothing is missing there."
    )
    set: list[str] = Field(description="Effects that the events do not distinguish here, the best first.")


class VersionOut(Result):
    """The model as given, refitted, and with the first of the effects, the first two ... and all."""

    name: str = Field(description="Change of the model.")
    error: MisfitOut = Field(description="In the fitted events.")
    error_held_out: MisfitOut | None = Field(description="In the held-out events; null without any.")
    events: list[EventErrors] = Field(description="In every event.")


class UnexplainedOut(Result):
    """Structure that remains in the residual, and its size."""

    share: Value = Field(description="Share of the residual's power that a regression on the motion predicts.")
    noise_ratio: NoiseRatio = Field(description="RMS of the rest in multiples of the floor.")
    of_excess: Value = Field(
        default=None,
        description="Share of the excess error (the power beyond the noise) that no effect explains.",
    )
    of_excess_held_out: Value = Field(
        default=None, description="The same in the held-out events; null without any, or if nothing is missing there."
    )


class ExceededOut(Result):
    """A quantity that a held-out earthquake has beyond the range of the fitted ones."""

    quantity: str = Field(description="`displacement` (m), `velocity` (m/s) or `temperature` (°C).")
    limit: Value = Field(description="End of the fitted range.")
    reached: Value = Field(description="Largest value in the earthquake, or its temperature.")
    share: Value = Field(description="Share of the squared error that lies beyond the limit.")


class OutOfRangeOut(Result):
    """A held-out earthquake in which the model fails although it fits the others."""

    name: str = Field(description="Name of the earthquake.")
    direction: str = Field(description="x or y.")
    noise_ratio: Value = Field(description="Error over the error that noise alone makes.")
    noise_ratio_fitted: Value = Field(description="The same where the model was fitted, in this direction.")
    nrmse: Value = Field(description="Error over the force there.")
    exceeded: list[ExceededOut] = Field(description="That with most of the error first; empty if all are within.")


class DirectionOut(Result):
    """Diagnosis of a model in one direction, by itself."""

    direction: str = Field(description="x or y.")
    outcome: str = Field(description="Of this direction alone, see `DiagnosisRow`.")
    set: list[str] = Field(description="Effects that the events do not distinguish, the best first.")
    effects: list[str] = Field(description="Missing effects, one after the other.")
    only_here: list[str] = Field(description="Those of them that are not missing in the other direction.")
    resembles: list[str] = Field(description="If the outcome is `unknown`: the nearest effects.")
    noise_ratio: NoiseRatio = Field(description="Noise ratio with these effects.")


class Findings(Result):
    """Content of a diagnosis."""

    findings: list[SuspectOut] = Field(description="Faults of sensors, superstructure and mass; they come first.")
    candidates: list[CandidateOut] = Field(description="Every effect that was tried, the best first.")
    dropped: list[DroppedOut] = Field(default=[], description="Effects that could not be checked, with the reason.")
    untried: list[str] = Field(
        default=[], description="Effects that were not tried, because the records are explained without them."
    )
    set: list[str] = Field(description="Effects that the events do not distinguish, the best first.")
    resembles: list[str] = Field(
        default=[], description="If the outcome is `unknown`: the nearest effects, none of which is the cause itself."
    )
    out_of_range: list[OutOfRangeOut] = Field(
        default=[], description="Held-out earthquakes in which the last version fails, the largest failure first."
    )
    directions: list[DirectionOut] = Field(
        default=[], description="Each direction by itself; empty where the records have one, or only one was wanted."
    )
    unknown_flag: bool = Field(description="True if something is missing that the known effects do not explain.")
    unexplained: UnexplainedOut = Field(description="Structure that remains after all steps.")
    steps: list[StepOut] = Field(description="Missing effects, one after the other.")
    versions: list[VersionOut] = Field(description="Their errors.")
    unused: list[str] = Field(description="Events that could not be used, with their reason.")


class DiagnosisDocument(Findings, Head):
    """A diagnosis of a model."""

    outcome: str | None = Field(description="See `DiagnosisRow`.")
    model: ModelValues | None = Field(
        description="With the last version's effects; null where no record could be used."
    )
    explanation: str


class ExtensionDocument(Head):
    """A model with one more effect."""

    added: CandidateOut
    versions: list[VersionOut]
    model: ModelValues
    explanation: str
    unused: list[str]


class StrongerOut(Result):
    """A prediction of stronger earthquakes by the model fitted to weaker ones."""

    fitted_to: list[str] = Field(description="Names of the weaker earthquakes.")
    reach: float = Field(description="Largest displacement of the predicted ones over that of those fitted.")
    errors: dict[str, float | None] = Field(
        description="Error of the force over the force, both root mean square, by predicted earthquake."
    )


class BeyondOut(Result):
    """Expected error of a prediction beyond the range of the fitted earthquakes."""

    times: float = Field(description="Displacement over the largest of the fitted earthquakes.")
    displacement: float = Field(description="m.")
    spread: float | None = Field(
        description="Largest difference there between the models fitted to weaker earthquakes and this one, over the "
        "force."
    )
    error: float | None = Field(
        description="Error over the force that is to be expected: of twice this difference, and of the worst "
        "prediction of stronger earthquakes by weaker ones."
    )


class LeftOut(Result):
    """A change of a model, and how well the model then predicts earthquakes that were left out in turn."""

    effect: str | None = Field(description="Effect that was added or removed; null for the model before all changes.")
    added: bool = Field(description="False if it was removed.")
    errors: dict[str, float | None] = Field(
        description="Error of the force over the force, both root mean square, by earthquake, by the model fitted to "
        "the others."
    )
    error: float | None = Field(description="Root mean square of these.")
    stronger: list[StrongerOut] = Field(
        default=[], description="Predictions of stronger earthquakes by weaker ones, which decide; the farthest last."
    )
    error_in_stronger: float | None = Field(default=None, description="Root mean square of the errors in these.")


class ImprovementDocument(Head):
    """A model that was diagnosed and extended by turns."""

    taken: list[str] = Field(description="Added effects.")
    versions: list[VersionOut]
    model: ModelValues
    diagnoses: list[DiagnosisDocument]
    left_out: list[LeftOut] = Field(
        description="Changes by which stronger earthquakes are predicted better by weaker ones; empty where diagnoses "
        "were enough."
    )
    beyond: list[BeyondOut] = Field(
        default=[], description="Errors to be expected beyond the range of the fitted earthquakes; empty as above."
    )
    explanation: str


def as_json(document: Head) -> dict[str, Any]:
    """Values of JSON; null for every number that JSON does not have."""
    values: dict[str, Any] = json_values(document.model_dump(by_alias=True))
    return values


def _by_effect(values: Mapping[str, Mapping[str, float]]) -> dict[str, dict[str, float | None]]:
    return {effect: dict(own) for effect, own in values.items()}
