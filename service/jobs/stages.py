"""Kinds of jobs: inputs are read, computed in other processes stage by stage with progress, and results are stored."""

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any

from sqlalchemy.orm import Session

from service.jobs.queue import Claim
from service.settings import Settings
from service.tracing import Work

ReportStep = Callable[[str, int, int], None]
"""Reports progress: the current step in words, the number of finished steps, and of all steps."""


def silent(doing: str, done: int, of: int) -> None:
    """Report to no one."""


@dataclass(frozen=True, slots=True)
class Report:
    """Progress of a computation."""

    doing: str
    """The current step, in words."""
    share: float = 0.0
    """Share of the computation that is done."""


@dataclass(frozen=True, slots=True)
class Note:
    """A file in which a computation reports its current step to another process."""

    path: Path

    def __call__(self, doing: str, done: int, of: int) -> None:
        """Report; failures are ignored, since a Dask worker on another machine has no such folder."""
        new = self.path.with_suffix(".new")
        with suppress(OSError):
            new.write_text(f"{done / max(of, 1):.2f} {doing}", "utf-8")
            new.replace(self.path)

    def erase(self) -> None:
        """Remove the file."""
        self.path.unlink(missing_ok=True)

    def read(self) -> Report | None:
        """The latest report; None before the first."""
        try:
            share, _, doing = self.path.read_text("utf-8").partition(" ")
        except FileNotFoundError:
            return None
        return Report(doing, float(share))


@dataclass(frozen=True, slots=True)
class Stage:
    """One computation; it receives and returns values, so that any process can run it."""

    doing: str
    """Description for people."""
    function: Callable[..., Any]
    """A module's function."""
    arguments: Callable[[Sequence[Any], ReportStep], tuple[Any, ...]]
    """Arguments of the function, from the results of earlier stages and a progress report."""
    key: str | None = None
    """Digest of everything that the result depends on, if another job may need it too: a worker that has it does not
    compute it again. The last stage of a job is always computed."""
    weight: float = 1.0
    """Its usual duration over that of an event's analysis: a rough estimate, for the display of progress."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of work with its own types of inputs and results."""

    inputs: Callable[[Session, Claim, Settings], Any]
    """Reads all inputs as stored now; raises errors of core where they do not suffice."""
    stages: Callable[[Any], Sequence[Stage]]
    """At least one stage, in order."""
    store: Callable[[Session, Claim, Any, Sequence[Any], datetime], None]
    """Stores the results of all stages, in the transaction that finishes the job."""


@dataclass(frozen=True, slots=True, eq=False)
class Running:
    """A job whose stage is being computed."""

    claim: Claim
    inputs: Any
    stages: Sequence[Stage]
    results: tuple[Any, ...] = ()
    """Results of the finished stages."""
    note: Note | None = None
    """The note with the stage's current step."""
    reported: Report | None = None
    """The latest report that was stored for display."""
    started: float = field(default_factory=time.monotonic)
    """Monotonic s when its first stage started."""
    trace: Work = field(default_factory=Work)
    """Trace of the job."""

    @property
    def stage(self) -> Stage:
        """The stage under computation."""
        return self.stages[len(self.results)]

    @property
    def news(self) -> Report | None:
        """The stage's latest report, if it is not stored yet."""
        found = self.note.read() if self.note else None
        return None if found == self.reported else found

    def share(self, of_stage: float) -> float:
        """Share of the job that is done, an estimate.

        Args:
            of_stage: the same of the current stage.
        """
        weights, done = [one.weight for one in self.stages], len(self.results)
        return (sum(weights[:done]) + of_stage * weights[done]) / sum(weights)
