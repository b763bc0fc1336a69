"""Jobs and the health of the service in the API."""

import re
from datetime import datetime
from typing import Any

from pydantic import Field, field_validator

from service.schema import Answer, Page

PATH = re.compile(r"(?<![\w.:/])(?:[A-Za-z]:)?[\\/][\w.@~+-]+(?:[\\/][\w.@~+-]*)+")
"""A path of this machine, two names deep at least."""
LONGEST = 300
"""Characters of an error that are shown."""


class Progress(Answer):
    """Progress of a job."""

    done: int = Field(description="Stages that are done.")
    stages: int = Field(description="Stages there are.")
    doing: str = Field(description="What is being done, in words.")


class JobOut(Answer):
    """A job: waiting, running, done, failed or cancelled."""

    id: int = Field(description="Its number.")
    kind: str = Field(description="Of which kind it is.")
    event_id: int | None = Field(description="Number of the event; null where it works on something else.")
    model_id: int | None = Field(description="Number of the model; null where it works on something else.")
    building_id: int | None = Field(description="Number of the building; null where it works on something else.")
    asked_by: str | None = Field(description="Name of the key that requested it; null for jobs of the service itself.")
    state: str = Field(description="`waiting`, `running`, `done`, `failed` or `cancelled`.")
    arguments: dict[str, Any] = Field(description="Arguments; for an analysis, those that differ from the settings.")
    claims: int = Field(description="How often a worker took it.")
    claimed_until: datetime | None = Field(description="End of the worker's lease; null while no worker has it.")
    error: str | None = Field(description="Latest error; null without one.")
    refusal: str | None = Field(description="Reason why it cannot be done; null if it can.")
    progress: Progress | None = Field(description="How far it is; null before a worker took it.")
    result: dict[str, Any] | None = Field(description="What came of it; null where other addresses answer that.")
    created_at: datetime = Field(description="When it was made.")
    finished_at: datetime | None = Field(description="When it was done or given up; null before.")

    @field_validator("error")
    @classmethod
    def _in_words(cls, error: str | None) -> str | None:
        return None if error is None else error_in_words(error)


class Jobs(Page[JobOut]):
    """A page of jobs, the latest first."""


class Health(Answer):
    """Liveness of the process."""

    status: str = Field(description="`alive`.", examples=["alive"])


class CheckOut(Answer):
    """One condition for the service to work."""

    name: str = Field(description="`database`, `disk`, `clock`, `poller`, `looks` or `worker`.")
    ok: bool = Field(description="Whether it is as it has to be.")
    since: datetime | None = Field(description="Since when it is not, as far as that is known; null while it is.")
    found: str = Field(description="What is so, in words.")
    helps: str = Field(description="What a person can do; empty where nothing has to be done.")


class Readiness(Answer):
    """Readiness of the service."""

    status: str = Field(description="`ready`.", examples=["ready"])
    checks: list[CheckOut] = Field(description="All that was checked.")


def error_in_words(error: str) -> str:
    """The last line of a traceback for display, without paths of this machine; the log has the full text.

    Args:
        error: a traceback as Python writes it, or a message.
    """
    lines = error.strip().splitlines()
    return PATH.sub("(a file)", lines[-1])[:LONGEST] if lines else ""
