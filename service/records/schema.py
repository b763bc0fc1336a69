"""Files as they came, as the API answers them."""

from datetime import datetime

from pydantic import Field

from service.schema import Answer


class RecordingOut(Answer):
    """A file, or an answer of a monitoring server, as it came."""

    id: int = Field(description="Number of the recording.", examples=[1])
    building: str = Field(description="Code of the building.")
    name: str = Field(description="Name of the file.", examples=["2024-01-01.mseed"])
    origin: str = Field(description="Where it came from: a path, or an address without user name, password and query.")
    received_at: datetime = Field(description="When it came.")
    size: int | None = Field(description="Bytes; null where they were not fetched, because there were too many.")
    kind: str = Field(description="`waveforms`, `station` or `unknown`.")
    state: str = Field(description="`waiting` (to be read), `read` or `rejected`.", examples=["rejected"])
    reason: str | None = Field(
        description="Why it was rejected, or what of a file that was read could not be used; null where nothing was."
    )
    start: datetime | None = Field(description="First sample; null where none could be used.")
    end: datetime | None = Field(description="Last sample; null where none could be used.")


class Recordings(Answer):
    """A page of recordings, the latest first."""

    items: list[RecordingOut] = Field(description="The rows of this page.")
    next: str | None = Field(description="Cursor of the next page; null after the last.")
