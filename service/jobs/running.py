"""What is a worker computing?"""

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from service.jobs.progress import Note
from service.jobs.queue import Claim
from service.jobs.stages import Stage


@dataclass(frozen=True, slots=True, eq=False)
class Running:
    """A job of which a stage is being computed, and what it is computed from."""

    claim: Claim
    inputs: Any
    stages: Sequence[Stage]
    results: tuple[Any, ...] = ()
    """Of the stages that are done."""
    note: Note | None = None
    """Into which the stage tells what it is doing."""
    told: str | None = None
    """What of that was passed on."""
    begun: float = field(default_factory=time.monotonic)
    """Monotonic s at which its first stage began."""

    @property
    def stage(self) -> Stage:
        """The one that is being computed."""
        return self.stages[len(self.results)]

    @property
    def news(self) -> str | None:
        """What the stage tells that was not passed on yet."""
        doing = self.note.read() if self.note else None
        return None if doing == self.told else doing
