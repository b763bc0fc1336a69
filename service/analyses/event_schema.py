"""Events, as the API answers them."""

from datetime import datetime

from pydantic import Field

from service.analyses.schema import DirectionOut, FindingOut, LayerOut, PeakOut, Provenance, SensorOut
from service.schema import Answer, Number
from service.verdict.schema import VerdictOut


class EventRow(Answer):
    """An event in a list."""

    id: int = Field(description="Its number.")
    start: datetime = Field(description="Of the first sample.")
    end: datetime = Field(description="Of the last sample.")
    state: str = Field(description="`gathering`, `queued`, `analysed`, `refused` or `failed`.")
    reason: str | None = Field(description="Why it was refused or failed.")
    pga: Number | None = Field(description="m/s²; null before the analysis, or where the ground is not measured.")
    analysis: int | None = Field(description="Number of the latest analysis; null before the first.")


class Events(Answer):
    """A page of events, the latest first."""

    items: list[EventRow] = Field(description="The rows of this page.")
    next: str | None = Field(description="Cursor of the next page; null after the last.")


class WaveformOut(Answer):
    """An unbroken piece of a channel."""

    channel: str = Field(description="Id of the channel.")
    start: datetime = Field(description="Of the first sample.")
    rate: Number = Field(description="Hz.")
    count: int = Field(description="Number of samples.")


class EventOut(Answer):
    """An event and what came of it."""

    id: int = Field(description="Its number.")
    building: str = Field(description="Code of the building.")
    start: datetime = Field(description="Of the first sample.")
    end: datetime = Field(description="Of the last sample.")
    state: str = Field(description="`gathering`, `queued`, `analysed`, `refused` or `failed`.")
    reason: str | None = Field(description="Why it was refused or failed; null where it was not.")
    pga: Number | None = Field(description="m/s², largest horizontal ground acceleration; null where not known.")
    temperature: Number | None = Field(description="°C, mean of its thermometers; null where nothing measured it.")
    waveforms: list[WaveformOut] = Field(description="The pieces of its channels.")
    analysis: Provenance | None = Field(description="The analysis that is shown; null before the first.")
    earlier: list[Provenance] = Field(description="The other analyses.")
    verdict: VerdictOut = Field(
        description="On the earthquake, by its latest analysis and the alerts that are open now."
    )
    quality: list[FindingOut] = Field(description="What screening found.")
    peaks: list[PeakOut] = Field(description="Of every channel.")
    sensors: list[SensorOut] = Field(description="Of every channel that could be used.")
    directions: list[DirectionOut] = Field(description="Empty before the analysis, or where it was refused.")
    layer: LayerOut | None = Field(description="Null where nothing is known across the directions.")
