"""Drift in the API: monitored series, baselines, values, alarms and reference periods."""

from datetime import datetime
from typing import Annotated

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, WithJsonSchema

from core.drift.quantities import QUANTITIES
from service.schema import Answer, Number, Page
from service.times import read_time

QUANTITY = f"One of {', '.join(f'`{name}`' for name in QUANTITIES)}."
SUBJECT = "A direction (`x`), both by their mean (`xy`), a mode of a direction (`x/1`) or the id of a channel."


def monitored_quantity(name: str) -> str:
    """The name of a monitored quantity."""
    if name not in QUANTITIES:
        raise ValueError(f"there is no quantity {name!r}; there are {', '.join(sorted(QUANTITIES))}")
    return name


QuantityName = Annotated[
    str, AfterValidator(monitored_quantity), WithJsonSchema({"type": "string", "enum": sorted(QUANTITIES)})
]

Given = Annotated[
    datetime,
    BeforeValidator(read_time),
    WithJsonSchema({"type": "string", "format": "date-time", "examples": ["2024-05-01T00:00:00Z"]}),
]


class SeriesRow(Answer):
    """One monitored series of a building."""

    quantity: str = Field(description=QUANTITY)
    subject: str = Field(description=SUBJECT)
    title: str = Field(description="Name of the quantity, for people.")
    events: int = Field(description="Events that have a value.")
    wanted: int = Field(description="Events that the baseline still needs.")
    latest_event: int | None = Field(description="Number of the latest event that has a value; null where none has.")
    latest_value: Number | None = Field(description="Its value, see the drift history; null where there is none.")
    latest_std: Number | None = Field(description="Standard deviation of it; null where there is none.")
    latest_is_excluded: bool = Field(description="True if a sensor finding excludes it from every rule.")
    latest_is_beyond: bool = Field(description="True if its amplitudes lie outside the reference's: no rule judges it.")
    alarms: int = Field(description="Alarms that the rules are sure of.")
    monitored_at: datetime = Field(description="When the series was last monitored.")


class SeriesRows(Answer):
    """The monitored series of a building."""

    building: str = Field(description="Code of the building.")
    items: list[SeriesRow] = Field(description="By quantity and subject.")
    next: None = Field(description="Always null: all are on one page.")


class CurvePoint(Answer):
    """The expected value at an amplitude."""

    amplitude: Number | None = Field(
        description="m, of a cycle of the isolation layer (for `model_error` the largest of the event); for "
        "`frequency` N, the largest restoring force. Null where the quantity follows no amplitude."
    )
    expected: Number = Field(description="SI units of the quantity.")
    low: Number = Field(description="Lower end of the band in which an event's value lies with 95 %.")
    high: Number = Field(description="Upper end of the same.")
    is_seen: bool = Field(description="True within the amplitudes of the reference; beyond them no alarm is raised.")


class BaselineOut(Answer):
    """The baseline: expected values of a healthy building over amplitude."""

    building: str = Field(description="Code of the building.")
    quantity: str = Field(description=QUANTITY)
    subject: str = Field(description=SUBJECT)
    temperature: Number | None = Field(
        description="°C of the curve; null where the temperature has no known influence."
    )
    lowest_amplitude: Number | None = Field(description="Lowest amplitude of the reference; null without one.")
    highest_amplitude: Number | None = Field(description="Highest amplitude of the reference; null without one.")
    reference_events: list[int] = Field(description="Numbers of the events of the reference.")
    wanted: int = Field(description="Events that the reference still needs until the curve is determined.")
    items: list[CurvePoint] = Field(
        description="The curve, amplitudes rising; empty as long as nothing is expected, and of `xy`, "
        "where each direction is compared with its own."
    )
    next: None = Field(description="Always null: the curve is on one page.")


class ObservationRow(Answer):
    """One measurement of a series, from a cycle or a whole event."""

    event: int = Field(description="Number of the event.")
    time: datetime = Field(description="Middle of the cycle, or start of the event.")
    value: Number = Field(description="SI units of the quantity.")
    std: Number = Field(description="Standard deviation in the same unit.")
    amplitude: Number | None = Field(description="As of the baseline; null where the quantity follows none.")
    temperature: Number | None = Field(description="°C; null where it was not measured.")


class Observations(Answer):
    """The measurements of a series."""

    building: str = Field(description="Code of the building.")
    items: list[ObservationRow] = Field(description="In order of time.")
    next: None = Field(description="Always null: all are on one page.")


class DriftRow(Answer):
    """An event's value in a series."""

    event: int = Field(description="Number of the event.")
    event_start: datetime = Field(description="Time of the event's first sample.")
    quantity: str = Field(description=QUANTITY)
    subject: str = Field(description=SUBJECT)
    value: Number = Field(
        description="Change from what was expected at the event's amplitudes and temperature: relative, -0.08 for 8 % "
        "less; of `residual_displacement` m."
    )
    std: Number = Field(description="Standard deviation, of curve, scatter of healthy events and observations.")
    count: int = Field(description="Number of measurements behind the value.")
    is_reference: bool = Field(description="True if the event belongs to the reference.")
    is_beyond: bool = Field(description="True if its amplitudes lie outside the reference's: no rule judges it.")
    is_excluded: bool = Field(description="True if a sensor finding excludes it from every rule.")
    causes: list[str] = Field(description="Other possible causes of a deviation.")


class Drift(Page[DriftRow]):
    """A page of values, the earliest event first."""

    building: str = Field(description="Code of the building.")


class DriftAlarmRow(Answer):
    """An alarm of a rule in a series."""

    quantity: str = Field(description=QUANTITY)
    subject: str = Field(description=SUBJECT)
    rule: str = Field(description="`sudden`, `slow`, `recovery` or `within` (one event).")
    is_sure: bool = Field(description="True if the rule is sure; otherwise evidence is still accumulating.")
    onset_event: int = Field(description="Number of the event with which the change most likely began.")
    onset_start: datetime = Field(description="Start of that event.")
    after_event: int | None = Field(description="Number of the last event without the change; null in old results.")
    changed_after: datetime | None = Field(description="Start of that event.")
    by_event: int | None = Field(
        description="Number of the first event with the change: with 95 % the change began between the two."
    )
    changed_by: datetime | None = Field(description="Start of that event.")
    raised_event: int = Field(description="Number of the event at which the rule was sure; else of the latest.")
    raised_start: datetime = Field(description="Start of that event.")
    events: list[int] = Field(description="Numbers of the events from the onset until then.")
    drift: Number = Field(description="Relative, -0.08 for 8 % less; of `residual_displacement` m.")
    low: Number = Field(description="Lower end of its 95 % interval.")
    high: Number = Field(description="Upper end of the same.")
    false_alarms: Number = Field(description="Share of histories of 100 healthy events in which the rule alarms.")
    causes: list[str] = Field(description="Other possible causes.")
    message: str = Field(description="One sentence for an engineer.")


class DriftAlarms(Answer):
    """The alarms of a building."""

    building: str = Field(description="Code of the building.")
    items: list[DriftAlarmRow] = Field(description="By quantity and subject, in the order in which they were raised.")
    next: None = Field(description="Always null: all are on one page.")


class ReferencePeriodOut(Answer):
    """A reference period, in which the building counts as healthy."""

    id: int = Field(description="Number of the period.")
    quantity: str | None = Field(description="Quantity of the period; null: all.")
    subject: str | None = Field(description="Direction, mode or channel for which it holds; null: for all of it.")
    start: datetime | None = Field(description="Null: from the first event on.")
    end: datetime | None = Field(description="Null: the first events until the curve is determined.")
    author: str = Field(description="Name of the key that set it.")
    reason: str = Field(description="Reason for the period.")
    created_at: datetime = Field(description="When it was set; of those that hold for a series the latest counts.")


class ReferencePeriods(Answer):
    """The reference periods of a building."""

    building: str = Field(description="Code of the building.")
    items: list[ReferencePeriodOut] = Field(description="The latest first.")
    next: None = Field(description="Always null: all are on one page.")


class ReferencePeriodRequest(BaseModel):
    """A period in which the building was healthy."""

    model_config = ConfigDict(extra="forbid")

    quantity: QuantityName | None = Field(None, description="Quantity of the period; null: all.")
    subject: str | None = Field(
        None,
        description="Direction (`x`), mode (`x/1`) or id of a channel for which it holds; null: for all of it.",
        pattern=r"^[!-~]{1,80}$",
    )
    start: Given | None = Field(None, description="Null: from the first event on.")
    end: Given | None = Field(None, description="Null: the first events until the curve is determined.")
    reason: str = Field(
        description="Why, for those who come later.",
        min_length=1,
        max_length=2000,
        examples=["bearings replaced in May 2024"],
    )
