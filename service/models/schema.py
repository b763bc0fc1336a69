"""Models of the isolation layer in the API; the results of work on them are in `service.models.results`."""

from collections.abc import Mapping
from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, field_validator, model_validator

from core import paper
from core.effects import EFFECTS
from core.errors import RecordError
from core.forecasting.ground_motion import FARTHEST, STRONGEST
from service.analyses.schema import FindingOut
from service.errors import FieldsError
from service.http.forms import ticked
from service.http.parameters import LARGEST
from service.models.motions import size
from service.models.results import Findings, MisfitOut, PredictionOut
from service.models.texts import NO_MOTION
from service.schema import Answer, Number, Page, Series


def whole(written: object) -> object:
    """A number without a fraction as an int, however it is written: to JSON, 2.0 is an integer."""
    return int(written) if isinstance(written, float) and written.is_integer() else written


Numbers = Annotated[
    list[Annotated[int, Field(ge=1, le=2**31 - 1), BeforeValidator(whole)]], Field(min_length=1, max_length=1000)
]
Wanted = Annotated[dict[str, dict[str, Number]], Field(max_length=50)]


HOLD_OUT = "hold_out_"
"""Begins the names of a form's boxes for the events to hold out."""


class ErrorOut(Answer):
    """Error of a model's force over some events together."""

    events: int = Field(description="Number of events.")
    nrmse: Number | None = Field(description="RMS of the error over RMS of the force; null where there was no force.")
    noise_floor: Number | None = Field(description="NRMSE of a correct model: the estimate's own error.")
    noise_ratio: Number | None = Field(description="RMS of the error in multiples of the floor; null where that is 0.")
    fitting_rate: Number | None = Field(description="%, as the paper defines it; null where the force is constant.")


class Errors(Answer):
    """The same by the events' role for the model; null without any."""

    fitted: ErrorOut | None = Field(description="Events that its values were fitted to.")
    held_out: ErrorOut | None = Field(description="Events that were held out of the fit.")
    later: ErrorOut | None = Field(description="Events that it was only compared with.")


class ModelRow(Answer):
    """A version of a model in a list."""

    id: int = Field(description="Its number among all models.")
    building: str = Field(description="Code of the building.")
    direction: str = Field(description="`x`, `y`, or `xy`: one set of values for both.")
    number: int = Field(description="Number of the version, from 1 for each building and direction.")
    parent: int | None = Field(description="Number of the model that it was made from; null of a first one.")
    state: str = Field(description="`draft`, `current` or `retired`.")
    change: str = Field(description="Change against the parent, and its reason.")
    author: str = Field(description="Name of the key that requested it.")
    created_at: datetime = Field(description="When it was made.")
    effects: list[str] = Field(description="Names of its effects.")
    errors: Errors = Field(description="Errors of its force, driven by the measured motion.")


class Models(Page[ModelRow]):
    """A page of models, the latest first."""


class Lineage(Answer):
    """A model and its ancestors."""

    items: list[ModelRow] = Field(description="The first one first.")


class ValueOut(Answer):
    """A parameter's value in a model."""

    effect: str = Field(description="Name of the effect.")
    parameter: str = Field(description="Name of the parameter.")
    value: Number = Field(description="In its unit.")
    std: Number | None = Field(description="Standard deviation; null where it was not fitted, or not determined.")
    unit: str | None = Field(description="SI; null of an effect that there is no longer.")
    meaning: str | None = Field(description="Meaning of the parameter; null of an effect that no longer exists.")


class ModelOut(ModelRow):
    """A version of a model."""

    accepted_by: str | None = Field(description="Name of the key that last made it current; null of a draft.")
    accepted_at: datetime | None = Field(description="When that was.")
    version: str = Field(description="Version of the code that made it.")
    revision_id: int = Field(description="Number of the building's description that it was made with.")
    reference: datetime | None = Field(description="From which effects count time; null as long as nothing was fitted.")
    values: list[ValueOut] = Field(description="Value of every parameter of its effects.")
    assumed: list[str] = Field(description="Parameters that were neither given nor measured: start values of a fit.")
    outcome: str | None = Field(
        description="Outcome of the fit, and the parameters that it could not determine; null where nothing was fitted."
    )
    fitted_to: list[int] = Field(description="Numbers of the events that its values were fitted to.")
    held_out: list[int] = Field(description="Numbers of the events that were held out of the fit.")


class ModelRequest(BaseModel):
    """Content of a new model."""

    model_config = ConfigDict(extra="forbid", strict=True)

    direction: Literal["x", "y", "xy"] = Field(
        description="x or y; xy for one set of values that holds in both.", examples=["x"]
    )
    effects: Wanted | None = Field(
        None,
        description="Value of every parameter, by effect; without it the first model by the building's design values.",
        examples=[{name: dict(values) for name, values in paper.ISOLATOR.effects.items()}],
    )
    change: str = Field("", max_length=2000, description="Why, in words.", examples=["as designed"])


class ComparisonRow(Answer):
    """A model compared with one event in one direction."""

    id: int = Field(description="Its number.")
    event: int = Field(description="Number of the event.")
    event_start: datetime = Field(description="Time of the event's first sample.")
    direction: str = Field(description="x or y, as the building file names it.")
    role: str = Field(description="`fitted`, `held_out` or `later`: the event's role for the model.")
    analysis: int = Field(description="Number of the analysis that it was compared with.")
    nrmse: Number | None = Field(description="NRMSE of the force, driven by the measured motion; null without a force.")
    noise_floor: Number | None = Field(description="NRMSE of a correct model.")
    noise_ratio: Number | None = Field(description="RMS of the error in multiples of the floor.")
    fitting_rate: Number | None = Field(description="%, as the paper defines it.")
    displacement_nrmse: Number | None = Field(
        description="NRMSE of the displacement, driven by the ground alone; null where nothing measured the ground."
    )
    created_at: datetime = Field(description="When it was made.")
    version: str = Field(description="Version of the code.")


class Comparisons(Page[ComparisonRow]):
    """A page of comparisons, the earliest event first."""


class ComparisonOut(ComparisonRow):
    """A model compared with one event in one direction, in full."""

    model: int = Field(description="Number of the model.")
    acceleration_nrmse: dict[str, Number | None] | None = Field(
        description="By level, driven by the ground alone; null where nothing measured the ground."
    )
    force: MisfitOut = Field(description="Error of the force, driven by the measured motion.")
    prediction: PredictionOut | None = Field(
        description="Errors of the response to the ground motion alone; null where nothing measured the ground."
    )


class ComparisonSeries(Answer):
    """Force of a model, driven by the measured motion, beside the estimated one."""

    comparison: int = Field(description="Number of the comparison.")
    model: int = Field(description="Number of the model.")
    event: int = Field(description="Number of the event.")
    direction: str = Field(description="x or y, as the building file names it.")
    start: datetime = Field(description="Time of the first sample.")
    rate: Number = Field(description="Hz.")
    step: Number = Field(description="s between samples.")
    count: int = Field(description="Number of samples before thinning.")
    time: Series | None = Field(description="s after `start`, where thinned; else null: sample i is at i · step.")
    displacement: Series | None = Field(None, description="m, of the isolation layer.")
    measured: Series | None = Field(None, description="N, the force as estimated from the records.")
    modelled: Series | None = Field(None, description="N, the model's.")


class TrendRow(Answer):
    """Error of a model in one event."""

    event: int = Field(description="Number of the event.")
    event_start: datetime = Field(description="Time of the event's first sample.")
    direction: str = Field(description="x or y, as the building file names it.")
    fitted: bool = Field(description="True if the model's values were fitted to it.")
    nrmse: Number | None = Field(description="NRMSE of the force, driven by the measured motion; null without a force.")
    noise_ratio: Number | None = Field(description="Noise ratio: RMS of the error over that of noise alone.")
    excess: Number = Field(description="Error beyond noise, as a share of the force's RMS.")
    allowed: Number | None = Field(description="The largest usual excess; null as long as nothing was fitted.")
    missed: bool = Field(description="True if the error is larger than in the fitted events.")


class Trend(Answer):
    """Errors of a model in every event, and whether it is still valid."""

    model: int = Field(description="Number of the model.")
    items: list[TrendRow] = Field(description="The earliest event first.")
    finding: FindingOut | None = Field(description="Finding on the latest events; null where the model is good.")


class WorkRequest(BaseModel):
    """Events to work with."""

    model_config = ConfigDict(extra="forbid", strict=True)

    events: Numbers | None = Field(
        None, description="Numbers of the events; without them all that can be compared.", examples=[[1, 2]]
    )


class FitRequest(WorkRequest):
    """Events to fit to, and events to test the result on."""

    hold_out: Numbers | None = Field(
        None,
        description="Numbers of events to hold out of the fit, on which the result is tested; without them none.",
        examples=[[3]],
    )


NEW_EFFECT = r"^[A-Za-z_][A-Za-z0-9_]{0,63}$"
"""A name that a new effect may have."""


class SketchRequest(FitRequest):
    """Events to sketch the missing force from, and events that only test its law."""

    name: str | None = Field(
        None,
        description="Name of the effect; without it `sketched_force`.",
        pattern=NEW_EFFECT,
        examples=["unknown_force"],
    )


class KeepRequest(BaseModel):
    """A sketch whose law is kept as an effect."""

    model_config = ConfigDict(extra="forbid", strict=True)

    sketch: Annotated[int, BeforeValidator(whole)] = Field(
        description="Number of the job of the sketch.", ge=1, le=LARGEST, examples=[1]
    )
    name: str = Field(description="Name of the effect.", pattern=NEW_EFFECT, examples=["our_wall"])


class ForecastScaling(BaseModel):
    """Target to which a ground motion is scaled, one at most, and the isolators' temperature."""

    model_config = ConfigDict(extra="forbid")

    pga: float | None = Field(
        None, description="m/s², peak ground acceleration to scale to.", gt=0, le=STRONGEST, allow_inf_nan=False
    )
    displacement: float | None = Field(
        None, description="m, displacement of the isolators to scale to.", gt=0, le=FARTHEST, allow_inf_nan=False
    )
    design_spectrum: bool = Field(False, description="True to scale to the design spectrum of the building file.")
    temperature: float | None = Field(
        None,
        description="°C, of the isolators; without it the middle of the records'.",
        ge=-60,
        le=100,
        allow_inf_nan=False,
    )


class ForecastRequest(ForecastScaling):
    """A ground motion to forecast the response to: that of a stored earthquake, scaled to one thing at most."""

    model_config = ConfigDict(extra="forbid", strict=True)

    earthquake: Annotated[int, BeforeValidator(whole)] = Field(
        description="Number of a stored event whose ground motion is used, of this building or of another one.",
        ge=1,
        le=LARGEST,
        examples=[1],
    )


class ForecastForm(BaseModel):
    """The same by a form: a size with its unit, and what it is of."""

    model_config = ConfigDict(extra="ignore", strict=True)

    earthquake: str = Field("", pattern=r"^\d{1,9}$")
    scaling: Literal["none", "pga", "displacement", "design_spectrum"] = "none"
    size: str = Field("", max_length=40)

    @property
    def request(self) -> ForecastRequest:
        """The request; pga in gal and displacement in mm unless a unit is given.

        Raises:
            FieldsError: the size is no number, has another unit, or is impossible.
        """
        if not self.earthquake:
            raise FieldsError({"earthquake": NO_MOTION})
        return ForecastRequest(earthquake=int(self.earthquake), **self.wanted_scaling.model_dump())

    @property
    def wanted_scaling(self) -> ForecastScaling:
        """Target to which the motion is scaled; units and errors as of `request`."""
        given: dict[str, object] = {}
        try:
            if self.scaling == "pga":
                given["pga"] = size(self.size, "acceleration", "gal")
            elif self.scaling == "displacement":
                given["displacement"] = size(self.size, "displacement", "mm")
            elif self.scaling == "design_spectrum":
                given["design_spectrum"] = True
            return ForecastScaling.model_validate(given)
        except RecordError as error:
            raise FieldsError({"size": str(error)}) from None
        except ValidationError as error:
            raise FieldsError({"size": f"this is impossible: {error.errors()[0]['msg'].lower()}"}) from None


class KeepForm(BaseModel):
    """A name for the law of a sketch, by a form."""

    model_config = ConfigDict(extra="ignore", strict=True)

    name: str = Field(pattern=NEW_EFFECT)


class EffectRequest(FitRequest):
    """An effect to add, and events to fit to."""

    effect: str = Field(
        description="Name of an effect that the model does not have.", max_length=64, examples=[next(iter(EFFECTS))]
    )


USE = "use_"
"""Beginning of the name of an event's three buttons in a form."""
USES = ("fit", "hold_out", "aside")


class FitForm(FitRequest):
    """The same by a form: a box for each event, or three buttons; it has fields of other buttons as well."""

    model_config = ConfigDict(extra="ignore", strict=True)

    @model_validator(mode="before")
    @classmethod
    def _boxes(cls, fields: dict[str, object]) -> dict[str, object]:
        chosen = {use: [one for one in ticked(fields, USE) if fields[f"{USE}{one}"] == use] for use in USES}
        lists = {
            "events": ticked(fields, "event_") + chosen["fit"],
            "hold_out": ticked(fields, HOLD_OUT) + chosen["hold_out"],
        }
        return fields | {name: numbers for name, numbers in lists.items() if numbers}

    @field_validator("events", "hold_out", mode="before")
    @classmethod
    def _numbers(cls, ticked: list[str] | None) -> list[int] | None:
        return None if ticked is None else [_number(one) for one in ticked]


class SketchForm(FitForm, SketchRequest):
    """The same by a form."""

    model_config = ConfigDict(extra="ignore", strict=True)


class EffectForm(FitForm, EffectRequest):
    """The same with an effect to add."""

    model_config = ConfigDict(extra="ignore", strict=True)


def held_out_by(fields: Mapping[str, str]) -> set[int]:
    """The events that a form holds out, if any."""
    return {int(one) for one in ticked(fields, HOLD_OUT) if one.isascii() and one.isdigit()}


def _number(typed: str) -> int:
    if not (typed.isascii() and typed.isdigit()):
        raise ValueError(f"there is no event {typed!r}")
    return int(typed)


class DiagnosisRow(Answer):
    """A diagnosis in a list."""

    id: int = Field(description="Its number.")
    model: int = Field(description="Number of the model.")
    outcome: str = Field(
        description="`nothing_missing`, `refit`, `effect`, `one_of_set`, `family`, `unknown`, `out_of_range`, "
        "`sensor_fault`, `superstructure` or `mass`."
    )
    explanation: str = Field(description="The same and more, in words.")
    fitted: list[int] = Field(description="Numbers of the events that candidates were fitted to.")
    held_out: list[int] = Field(description="Numbers of the events held out.")
    analyses: list[int] = Field(
        description="Numbers of the analyses of all of them, and of refused events that only show the sensors' state."
    )
    revision_id: int = Field(description="Number of the building's description.")
    author: str = Field(description="Name of the key that requested it.")
    created_at: datetime = Field(description="When it was made.")
    version: str = Field(description="Version of the code.")
    job: int = Field(description="Number of the job that made it.")


class Diagnoses(Page[DiagnosisRow]):
    """A page of diagnoses, the latest first."""


class DiagnosisOut(Findings, DiagnosisRow):
    """A diagnosis, in full."""


class EffectRow(Answer):
    """A physical effect in a list."""

    name: str = Field(description="As models have it.")
    title: str = Field(description="The effect in a few words.")
    family: str = Field(description="Effects of one family leave similar traces, and records may not distinguish them.")
    suspect_when: str = Field(description="Signs of it in the measurements.")


class Effects(Answer):
    """All effects there are."""

    items: list[EffectRow] = Field(description="By family and name.")
    next: str | None = Field(description="Null: all are on this page.")


class KeptEffectRow(Answer):
    """A sketched law that is kept as an effect."""

    name: str = Field(description="Name of the effect.")
    formula: str | None = Field(
        description="Its law; null if this version of Menshin does not know one of its terms, and no model can be "
        "given the effect."
    )
    created_at: datetime = Field(description="When it was kept.")
    author: str | None = Field(
        description="Name of the key that kept it; null, as the next ones, for callers that may not see the building, "
        "and once the sketch is gone."
    )
    building: str | None = Field(description="Code of the building whose records were sketched.")
    model: int | None = Field(description="Number of the model that was sketched.")
    sketch: int | None = Field(description="Number of the job of the sketch.")


class KeptEffects(Answer):
    """All kept effects."""

    items: list[KeptEffectRow] = Field(description="By name.")
    next: str | None = Field(description="Null: all are on this page.")


class ParameterOut(Answer):
    """One number that an effect is fitted with."""

    name: str = Field(description="As models have it.")
    unit: str = Field(description="SI; 1 for a number without unit.")
    lowest: Number = Field(description="The least value it may take.")
    highest: Number = Field(description="The largest value it may take.")
    usual: Number = Field(description="A usual value at which the effect is present.")
    meaning: str = Field(description="Meaning of the parameter.")


class EffectOut(EffectRow):
    """A physical effect, explained."""

    explanation: str = Field(description="Its action, in a sentence that names its parameters.")
    acts_on: str = Field(description="`force`, or what other effects read, such as `stiffness`.")
    kind: str | None = Field(
        description="Kind of its force, which effects on temperature, load or age scale: `rubber`, `yielding` or "
        "`sliding`; null for a force that they do not scale, or no force."
    )
    absent: dict[str, Number] = Field(description="Values of parameters at which it does nothing at all.")
    kept: list[str] = Field(description="States that the layer keeps from one earthquake to the next.")
    parameters: list[ParameterOut] = Field(description="Its parameters, which a model gives values to.")
    law: str = Field(description="Its formula, as Python source: after what it does come the rates of its states.")
    source: str = Field(description="Author, year, equation.")
