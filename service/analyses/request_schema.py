"""What an engineer may ask of an analysis."""

from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, Strict, WithJsonSchema

from core.estimators.by_name import ESTIMATORS


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
