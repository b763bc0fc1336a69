"""What a kind of work is: read, computed elsewhere stage by stage, written."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy.orm import Session

from service.jobs.progress import Tell
from service.jobs.queue import Claim
from service.settings import Settings


@dataclass(frozen=True, slots=True)
class Stage:
    """One computation; it receives and returns values, so that any process can do it."""

    doing: str
    """For who waits."""
    function: Callable[..., Any]
    """Of a module."""
    arguments: Callable[[Sequence[Any], Tell], tuple[Any, ...]]
    """Of the function, from the results of the stages before and what tells how far it is."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of work; what it reads is its own, and so is what its stages return."""

    inputs: Callable[[Session, Claim, Settings], Any]
    """All that it is made from, as it is stored now; raises core's errors where there is too little."""
    stages: Callable[[Any], Sequence[Stage]]
    """In order, one at least."""
    store: Callable[[Session, Claim, Any, Sequence[Any], datetime], None]
    """Writes what came of the inputs by the results of all stages, in the transaction that finishes the job."""
