"""The physical effects that a model may have, as the API answers them."""

from pydantic import Field

from service.schema import Answer, Number


class EffectRow(Answer):
    """A physical effect in a list."""

    name: str = Field(description="As models have it.")
    title: str = Field(description="What it is.")
    family: str = Field(description="Effects of one family leave alike traces; records may not tell them apart.")
    suspect_when: str = Field(description="What in the measurements makes one think of it.")


class Effects(Answer):
    """All effects there are."""

    items: list[EffectRow] = Field(description="By family and name.")
    next: str | None = Field(description="Null: all are on this page.")


class ParameterOut(Answer):
    """One number that an effect is fitted with."""

    name: str = Field(description="As models have it.")
    unit: str = Field(description="SI; 1 for a number without unit.")
    lowest: Number = Field(description="The least value it may take.")
    highest: Number = Field(description="The largest value it may take.")
    usual: Number = Field(description="A usual value at which the effect is present.")
    meaning: str = Field(description="What it is.")


class EffectOut(EffectRow):
    """A physical effect, explained."""

    explanation: str = Field(description="What it does, in a sentence that names its parameters.")
    acts_on: str = Field(description="`force`, or what other effects read, such as `stiffness`.")
    absent: dict[str, Number] = Field(description="Values of parameters at which it does nothing at all.")
    kept: list[str] = Field(description="States that the layer keeps from one earthquake to the next.")
    parameters: list[ParameterOut] = Field(description="What a model gives values to.")
    law: str = Field(description="Its formula, as Python source: after what it does come the rates of its states.")
    source: str = Field(description="Author, year, equation.")
