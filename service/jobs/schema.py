"""Jobs in the API."""

import re
from datetime import datetime
from typing import Any

from pydantic import Field, field_validator

from service.schema import Answer, Number, Page

PATH = re.compile(r"(?<![\w.:/])(?:[A-Za-z]:)?[\\/][\w.@~+-]+(?:[\\/][\w.@~+-]*)+")
"""A path of this machine, two names deep at least."""
LONGEST = 300
"""Characters of an error that are shown."""


class Progress(Answer):
    """Progress of a job."""

    done: int = Field(description="Stages that are done.")
    stages: int = Field(description="Stages there are.")
    doing: str = Field(description="The current step, in words.")
    share: Number = Field(0.0, description="Share of the job that is done, 0 to 1, an estimate.")


class JobOut(Answer):
    """A job: waiting, running, done, failed or cancelled."""

    id: int = Field(description="Its number.")
    kind: str = Field(description="Its kind.")
    event_id: int | None = Field(description="Number of the event; null where it works on something else.")
    model_id: int | None = Field(description="Number of the model; null where it works on something else.")
    building_id: int | None = Field(description="Number of the building; null where it works on something else.")
    asked_by: str | None = Field(description="Name of the key that requested it; null for jobs of the service itself.")
    state: str = Field(description="`waiting`, `running`, `done`, `failed` or `cancelled`.")
    arguments: dict[str, Any] = Field(description="Arguments; for an analysis, those that differ from the settings.")
    claims: int = Field(description="Number of times that a worker claimed it.")
    claimed_until: datetime | None = Field(description="End of the worker's lease; null while it is not claimed.")
    error: str | None = Field(description="Latest error; null without one.")
    refusal: str | None = Field(description="Reason why it cannot be done; null if it can.")
    progress: Progress | None = Field(description="Its progress; null before a worker claimed it.")
    result: dict[str, Any] | None = Field(description="Its result; null where other addresses give it.")
    created_at: datetime = Field(description="Time when it was queued.")
    finished_at: datetime | None = Field(description="Time when it ended; null before.")

    @field_validator("error")
    @classmethod
    def _in_words(cls, error: str | None) -> str | None:
        return None if error is None else error_in_words(error)


class Jobs(Page[JobOut]):
    """A page of jobs, the latest first."""


def error_in_words(error: str) -> str:
    """The last line of a traceback for display, without paths of this machine; the log has the full text.

    Args:
        error: a traceback as Python writes it, or a message.
    """
    lines = error.strip().splitlines()
    return PATH.sub("(a file)", lines[-1])[:LONGEST] if lines else ""
