"""Schema of a diagnosis in the API."""

from datetime import datetime
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from service.schema import Answer, Number, Page


class Kept(BaseModel):
    """Part of what was written once and is kept; another version of the code may have written more."""

    model_config = ConfigDict(extra="ignore")


class SuspectOut(Kept):
    """What is wrong before the isolation layer is asked."""

    cause: str = Field(description="`sensor_fault`, `superstructure` or `mass`.")
    kind: str = Field(description="Of which kind it is.")
    channel: str | None = Field(description="Id of the channel, or name of the level; null where it is of the whole.")
    value: Number | None = Field(description="The measure of it, in the unit that the message gives.")
    std: Number | None = Field(description="Its standard deviation; null where it has none.")
    message: str = Field(description="The problem and its remedy.")


class FittedValue(Kept):
    """A parameter of an effect that was tried."""

    value: Number = Field(description="In its unit.")
    std: Number | None = Field(description="Standard deviation; null where it was not fitted, or not determined.")
    unit: str = Field(description="SI.")


class CandidateOut(Kept):
    """An effect that was tried: added to the model, everything fitted anew."""

    effect: str = Field(description="Its name.")
    family: str = Field(description="Effects of one family leave alike traces.")
    delta_bic: Number | None = Field(description="The events support it below -10.")
    error_before: Number | None = Field(description="N, RMS of the force's error in the events fitted, without it.")
    error_after: Number | None = Field(description="The same with it.")
    error_after_held_out: Number | None = Field(description="The same in the events held out; null without any.")
    noise_floor: Number | None = Field(description="N, RMS of the error that a right model would have.")
    plausible: bool = Field(description="Whether a layer may be so.")
    reason: str | None = Field(description="Why it may not; null where it may.")
    parameters: dict[str, FittedValue] = Field(description="Of the effect, by name.")


class DroppedOut(Kept):
    """An effect that could not be checked."""

    effect: str = Field(description="Its name.")
    reason: str = Field(description="Why, in words.")


class StepOut(Kept):
    """An effect that is missing, beside those of the steps before."""

    effect: str = Field(description="Its name.")
    family: str = Field(description="Its family.")
    delta_bic: Number | None = Field(description="Of the model with it less that without.")
    set: list[str] = Field(description="Effects that the events do not distinguish here, the best first.")


class MisfitOut(Kept):
    """How far the force is off, over some events taken together."""

    rms: Number | None = Field(description="N.")
    nrmse: Number | None = Field(description="RMS of the error over RMS of the force.")
    fitting_rate: Number | None = Field(description="%, as the paper has it.")
    noise_floor: Number | None = Field(description="N, RMS that a right model would leave.")
    in_noise_floors: Number | None = Field(description="RMS of the error in multiples of the floor.")


class VersionOut(Kept):
    """The model as given, refitted, and with the first of the effects, the first two ... and all."""

    name: str = Field(description="What was done to the model.")
    error: MisfitOut = Field(description="In the events fitted.")
    error_held_out: MisfitOut | None = Field(description="In the events held out; null without any.")
    events: list[dict[str, Any]] = Field(description="In every event: `force`, and the response to the ground alone.")


class UnexplainedOut(Kept):
    """Structure that remains in the residual, and its size."""

    share: Number | None = Field(description="Of the residual's power that a regression on the motion foretells.")
    in_noise_floors: Number | None = Field(description="RMS of what is left in multiples of the floor.")


class DiagnosisRow(Answer):
    """A diagnosis in a list."""

    id: int = Field(description="Its number.")
    model: int = Field(description="Number of the model.")
    outcome: str = Field(
        description="`nothing_missing`, `refit`, `effect`, `one_of_set`, `family`, `unknown`, `sensor_fault`, "
        "`superstructure` or `mass`."
    )
    explanation: str = Field(description="The same and more, in words.")
    fitted: list[int] = Field(description="Numbers of the events that candidates were fitted to.")
    left_out: list[int] = Field(description="Numbers of the events held out.")
    analyses: list[int] = Field(
        description="Numbers of the analyses of all of them, and of refused events that were asked for their sensors."
    )
    revision_id: int = Field(description="Of the building's description.")
    author: str = Field(description="Name of the key that asked for it.")
    created_at: datetime = Field(description="When it was made.")
    version: str = Field(description="Of the code.")
    job: int = Field(description="Number of the job that made it.")


class Diagnoses(Page[DiagnosisRow]):
    """A page of diagnoses, the latest first."""


class DiagnosisOut(DiagnosisRow):
    """A diagnosis, in full."""

    findings: list[SuspectOut] = Field(description="Of sensors, superstructure and mass; they come first.")
    candidates: list[CandidateOut] = Field(description="Every effect that the model has not, the best first.")
    dropped: list[DroppedOut] = Field(description="Effects that could not be checked, with the reason.")
    set: list[str] = Field(description="Effects that the events do not distinguish, the best first.")
    unknown_flag: bool = Field(description="Whether something is missing that the known effects do not explain.")
    unexplained: UnexplainedOut = Field(description="What is left with all steps taken.")
    steps: list[StepOut] = Field(description="Effects that are missing, one after the other.")
    versions: list[VersionOut] = Field(description="Their errors.")
    unused: list[str] = Field(description="Events that could not be used, with their reason.")
