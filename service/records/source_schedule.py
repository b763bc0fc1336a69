"""The schedule of polls of the sources, in threads: a failing source backs off, a stalled one delays no other."""

import logging
from collections import OrderedDict
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from itertools import islice
from math import inf
from threading import Lock, Thread
from time import monotonic

log = logging.getLogger(__name__)

QUICK = 10
"""Polls that run at the same time, without the long ones."""
LASTING = 4.0
"""s after which a poll counts as long and gives its place to another."""
TOGETHER = 30
"""Polls of working sources that run at the same time, long ones included."""
FAILING = 8
"""Polls of failing sources that run at the same time, in places of their own."""
LONGEST_PAUSE = 300.0
"""s, longest time between two polls of a failing source, unless the interval is longer."""
TO_END = 3.0
"""s given to polls when the service stops; those that last longer are abandoned without loss."""


@dataclass(frozen=True, slots=True)
class Running:
    """A poll that is under way."""

    thread: Thread
    since: float
    """s of the timer."""
    is_failing: bool


@dataclass(slots=True)
class SourceSchedule:
    """Schedule of the polls: of each source at most one at a time, soon after it is due."""

    poll: Callable[[str], bool]
    """Polls a source, by the code of its building; False if the source failed."""
    interval: float
    """s between two polls of a source that answers."""
    timer: Callable[[], float] = monotonic
    failures: dict[str, int] = field(default_factory=dict)
    """Polls that failed in a row, of failing sources."""
    resting: dict[str, float] = field(default_factory=dict)
    """Time of the timer before which a failing source is not polled."""
    waiting: OrderedDict[str, None] = field(default_factory=OrderedDict)
    """The working sources that wait, in order."""
    failing: OrderedDict[str, None] = field(default_factory=OrderedDict)
    """The failing ones that wait, in order: they have places of their own."""
    running: dict[str, Running] = field(default_factory=dict)
    is_ending: bool = False
    lock: Lock = field(default_factory=Lock)

    def expect_failure(self, codes: Iterable[str]) -> None:
        """Treat sources that are known to fail as failing from their first poll on."""
        with self.lock:
            for code in codes:
                self.failures.setdefault(code, 0)
                if code in self.waiting:
                    del self.waiting[code]
                    self.failing[code] = None

    def due(self, code: str) -> None:
        """Poll a source as soon as there is a place, unless it is waiting, running or resting after a failure."""
        with self.lock:
            if code not in self.running and self.timer() >= self.resting.get(code, -inf):
                self._queue_of(code)[code] = None
            self._start()

    def go_on(self) -> None:
        """Give the places of long polls to waiting ones; called every few seconds."""
        with self.lock:
            self._start()

    def end(self) -> list[str]:
        """Start no further poll and wait a moment for the running ones; returns the codes of those that did not end."""
        with self.lock:
            self.is_ending = True
            left = dict(self.running)
        end = monotonic() + TO_END
        for one in left.values():
            one.thread.join(max(end - monotonic(), 0.0))
        return sorted(code for code, one in left.items() if one.thread.is_alive())

    def next(self, most: int) -> list[str]:
        """Codes of the working sources that wait for a place, the first ones first, at most so many."""
        with self.lock:
            return list(islice(self.waiting, most))

    def lasting(self) -> list[tuple[str, float]]:
        """(code, s since it began) of the polls that are long by now."""
        now = self.timer()
        with self.lock:
            return [(code, now - one.since) for code, one in self.running.items() if now - one.since >= LASTING]

    def _queue_of(self, code: str) -> OrderedDict[str, None]:
        return self.failing if code in self.failures else self.waiting

    def _start(self) -> None:
        """Start the first ones that wait, as many as there is room for; the others are not looked at."""
        for queue, is_failing in ((self.waiting, False), (self.failing, True)):
            while queue and not self.is_ending and self._has_room(is_failing):
                code, _ = queue.popitem(last=False)
                thread = Thread(target=self._run, args=(code,), name=f"poll {code}", daemon=True)
                self.running[code] = Running(thread, self.timer(), is_failing)
                thread.start()

    def _has_room(self, is_failing: bool) -> bool:
        alike = [one for one in self.running.values() if one.is_failing == is_failing]
        if is_failing:
            return len(alike) < FAILING
        quick = sum(self.timer() - one.since < LASTING for one in alike)
        return quick < QUICK and len(alike) < TOGETHER

    def _run(self, code: str) -> None:
        answered = True
        try:
            answered = self.poll(code)
        finally:
            with self.lock:
                del self.running[code]
                self._note(code, answered)
                self._start()

    def _note(self, code: str, answered: bool) -> None:
        """Let a failing source rest ever longer, less half an interval, because it is due at whole intervals only."""
        if answered:
            self.failures.pop(code, None)
            self.resting.pop(code, None)
            return
        self.failures[code] = failures = self.failures.get(code, 0) + 1
        pause = min(self.interval * 2.0 ** min(failures - 1, 32), max(self.interval, LONGEST_PAUSE))
        self.resting[code] = self.timer() + pause - self.interval / 2
