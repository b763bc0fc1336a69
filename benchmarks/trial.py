"""Time and memory of computations, each in a process of its own within limits."""

import multiprocessing
import os
import resource
import signal
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from multiprocessing.connection import Connection
from pathlib import Path
from statistics import median
from time import process_time
from typing import Generic, TypeVar

Result = TypeVar("Result")

ROUNDS = 3
"""Over all ways, one after the other, so that what slows the machine down for a while slows them all."""
BURST = 0.25
"""s of processor time, over which calls are averaged in each round: the clock of some machines ticks in 4 ms."""
LONG = 10.0
"""s of processor time: a first call that took longer is the only one; else it is not counted, since it compiles."""
SLOW = 2.0
"""s of processor time: a call that takes longer is tried in one round only."""
LARGEST_BLOCK = 31 * 2**20
"""Bytes, taken and freed before the clock starts, as in a process that has worked for a while: the C library then keeps
blocks up to that size when they are freed, and what a virtual machine takes to hand them out anew is not measured."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of one process."""

    seconds: int = 60
    """s of processor time."""
    gigabytes: float = 6.0
    """GB of address space."""


@dataclass(frozen=True, slots=True)
class Way(Generic[Result]):
    """One way to compute the same thing."""

    name: str
    module: str
    """Modules that it needs, imported before the clock starts."""
    compute: Callable[[], Result]


@dataclass(frozen=True, slots=True)
class Trial(Generic[Result]):
    """Time, memory and result of one method."""

    seconds: float
    """Processor time of a call, median of the rounds."""
    megabytes: float
    """Bytes by which the process grew."""
    result: Result


@dataclass(frozen=True, slots=True)
class Refusal:
    """Reason why there is no trial."""

    reason: str


def trials(ways: Sequence[Way[Result]], limits: Limits, rounds: int = ROUNDS) -> Mapping[str, Trial[Result] | Refusal]:
    """Every way's trial by its name, in the same order; the ways take turns."""
    tried: dict[str, list[Trial[Result]]] = {way.name: [] for way in ways}
    refused: dict[str, Refusal] = {}
    for _ in range(rounds):
        for way in ways:
            if way.name in refused or any(trial.seconds > SLOW for trial in tried[way.name]):
                continue  # it failed, or is so slow that one round must do
            outcome = _apart(way, limits)
            if isinstance(outcome, Refusal):
                refused[way.name] = outcome
            else:
                tried[way.name].append(outcome)
    return {way.name: refused.get(way.name) or _median(tried[way.name]) for way in ways}


def _median(rounds: Sequence[Trial[Result]]) -> Trial[Result]:
    seconds, megabytes = (median(getattr(trial, field) for trial in rounds) for field in ("seconds", "megabytes"))
    return Trial(seconds, megabytes, rounds[-1].result)


def _apart(way: Way[Result], limits: Limits) -> Trial[Result] | Refusal:
    """One round, in a process of its own."""
    package = way.module.partition(".")[0]
    if find_spec(package) is None:
        return Refusal("not installed")
    fork = multiprocessing.get_context("fork")  # the data need not be sent, nor what is common imported again
    receiving, sending = fork.Pipe(duplex=False)
    process = fork.Process(target=_child, args=(sending, way, limits))
    process.start()
    sending.close()
    try:
        outcome: Trial[Result] | Refusal = receiving.recv()
    except EOFError:
        process.join()
        return Refusal(_ending(process.exitcode, limits))
    process.join()
    return outcome


def _ending(exitcode: int | None, limits: Limits) -> str:
    if exitcode in (-signal.SIGXCPU, -signal.SIGKILL):
        return f"stopped after {limits.seconds} s"
    return f"its process ended with {exitcode}"


def _child(sending: Connection, way: Way[Result], limits: Limits) -> None:
    quiet = os.open(os.devnull, os.O_WRONLY)  # some peers print, and some from C
    os.dup2(quiet, 1)
    os.dup2(quiet, 2)
    resource.setrlimit(resource.RLIMIT_CPU, (limits.seconds, limits.seconds + 5))
    memory = int(limits.gigabytes * 2**30)
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    try:
        import_module(way.module)
        outcome: object = _timed(way.compute)
    except MemoryError:
        outcome = Refusal(f"needs more than {limits.gigabytes:g} GB")
    except Exception as error:  # a peer may fail in any way of its own; the table says how
        outcome = Refusal(f"{type(error).__name__}: {error}".splitlines()[0])
    sending.send(outcome)


def _timed(compute: Callable[[], Result]) -> Trial[Result]:
    bytes(LARGEST_BLOCK)
    before = _resident("VmRSS")
    Path("/proc/self/clear_refs").write_text("5")  # the high-water mark begins anew
    start = process_time()
    result = compute()
    first = process_time() - start
    grown = _resident("VmHWM") - before
    if first > LONG:
        return Trial(first, grown, result)
    start, calls = process_time(), 0
    while process_time() - start < BURST:
        compute()
        calls += 1
    return Trial((process_time() - start) / calls, grown, result)


def _resident(field: str) -> float:
    """MB, as Linux says."""
    line = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith(field))
    return float(line.split()[1]) / 1024
