"""Findings of an examination, and checks that end in time."""

import logging
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from queue import Empty, SimpleQueue
from threading import Thread
from time import monotonic
from typing import TypeVar

from sqlalchemy.exc import SQLAlchemyError

from service.addresses import without_credentials
from service.db.encryption import SecretKeyError
from service.db.problems import problem

log = logging.getLogger(__name__)


class State(StrEnum):
    """The state of one thing."""

    GOOD = "good"
    NOTE = "note"
    """It works, and people should know."""
    WRONG = "wrong"
    UNKNOWN = "unknown"
    """It could not be examined."""


@dataclass(frozen=True, slots=True)
class Finding:
    """The state of one thing, in words without secrets."""

    check: str
    """Subject of the check, such as `mail`."""
    state: State
    found: str
    helps: str = ""
    """Remedy; empty where none is needed."""


Found = tuple[State, str, str]
"""State, words, remedy."""
Check = Callable[[], Iterable[Found]]
Result = TypeVar("Result")
BUG = "please report what standard error says"


def good(found: str) -> Found:
    """A thing that is as it should be."""
    return State.GOOD, found, ""


def note(found: str, helps: str) -> Found:
    """A thing that works, and that people should know."""
    return State.NOTE, found, helps


def wrong(found: str, helps: str) -> Found:
    """A thing that does not work."""
    return State.WRONG, found, helps


def unknown(found: str, helps: str) -> Found:
    """A thing that could not be examined."""
    return State.UNKNOWN, found, helps


def examined(checks: Mapping[str, Check], timeout: float) -> tuple[Finding, ...]:
    """The findings of all checks, which run at the same time, in the order of the checks.

    Args:
        checks: by name.
        timeout: s that all of them have. A check that takes longer is left to itself in a thread that does not keep
            the process alive.
    """
    results = results_in_time({name: partial(_outcome, check) for name, check in checks.items()}, timeout)
    late = (
        unknown(f"no answer within {timeout:g} s", "allow more time with --timeout, or find out what it waits for"),
    )
    return tuple(
        Finding(name, state, without_credentials(found), without_credentials(helps))
        for name in checks
        for state, found, helps in results.get(name, late)
    )


def results_in_time(tasks: Mapping[str, Callable[[], Result]], timeout: float) -> dict[str, Result]:
    """The results of tasks that run at the same time, by name; those that take longer are omitted."""
    done: SimpleQueue[tuple[str, Result]] = SimpleQueue()
    end = monotonic() + timeout
    for name, task in tasks.items():
        Thread(target=_put, args=(done, name, task), daemon=True, name=name).start()
    results: dict[str, Result] = {}
    while len(results) < len(tasks):
        try:
            name, result = done.get(timeout=max(end - monotonic(), 0.0))
        except Empty:
            break
        results[name] = result
    return results


def _put(done: "SimpleQueue[tuple[str, Result]]", name: str, task: Callable[[], Result]) -> None:
    done.put((name, task()))


def _outcome(check: Check) -> tuple[Found, ...]:
    """Findings of a check; its failure is a finding too."""
    found: list[Found] = []
    try:
        found.extend(check())  # keeps those before a failure
    except SecretKeyError as error:
        sentence, _, helps = str(error).partition(". ")
        found.append(wrong(sentence, helps.rstrip(".")))
    except Exception as error:  # the other checks go on
        words = problem(error) if isinstance(error, SQLAlchemyError) else None
        if words is None:
            log.error("a check failed", exc_info=error)
            found.append(unknown(f"the check itself failed ({type(error).__name__})", BUG))
        else:
            sentence, _, helps = words.partition("; ")
            found.append(wrong(sentence, helps))
    return tuple(found)
