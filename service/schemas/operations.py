"""Jobs and the service's health, as the API answers them."""

from datetime import datetime
from typing import Any

from pydantic import Field

from service.schemas.answer import Answer


class JobOut(Answer):
    """An analysis that waits, runs, is done or has failed."""

    id: int = Field(description="Its number.")
    kind: str = Field(description="Of which kind it is.")
    event_id: int = Field(description="Number of the event.")
    state: str = Field(description="`waiting`, `running`, `done` or `failed`.")
    arguments: dict[str, Any] = Field(description="What differs from the service's settings.")
    claims: int = Field(description="How often a worker took it.")
    claimed_until: datetime | None = Field(description="End of the worker's lease; null while nobody works on it.")
    error: str | None = Field(description="What went wrong last; null where nothing did.")
    created_at: datetime = Field(description="When it was made.")
    finished_at: datetime | None = Field(description="When it was done or given up; null before.")


class Jobs(Answer):
    """A page of jobs, the latest first."""

    items: list[JobOut] = Field(description="The rows of this page.")
    next: str | None = Field(description="Cursor of the next page; null after the last.")


class Health(Answer):
    """How the service is doing."""

    status: str = Field(description="`alive` or `ready`.", examples=["ready"])
