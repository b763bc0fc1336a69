"""What is followed over the years, as the API answers it."""

from datetime import datetime

from pydantic import Field

from service.schema import Answer, Number


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
