"""The database's part of polls of quiet sources, for many sources at once.

While sources wait for their turn, one query reads the states of the next ones, and one transaction stores the ends of
polls that brought nothing. Where none waits, each poll reads and stores for itself.
"""

from collections import defaultdict
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from functools import cache
from threading import Lock
from time import monotonic

from sqlalchemy import Update, bindparam, exists, or_, update
from sqlalchemy.orm import Session, sessionmaker

from service.buildings.queries import latest_revision
from service.buildings.tables import Building
from service.db.base import Base
from service.db.select import Line, Question
from service.db.sessions import reading
from service.records.ingest import CLOCK_SLACK, FAILED_BEFORE, past_by
from service.records.tables import STORED, Recording, SourceState

MANY = 50
"""Sources that are read, or polls whose ends are stored, at once. A choice."""
FRESH = 5.0
"""s for which the state of a source that waits is good; a change of its building file is seen that much later."""
LATEST = 1.0
"""s after which the end of a poll is no longer kept for later: the next poll that ends stores it."""


def none_waits(_: int) -> list[str]:
    """Codes of the next sources where each is polled by itself."""
    return []


@dataclass(frozen=True, slots=True)
class PolledTogether:
    """States of sources before their polls, and ends of quiet polls."""

    sessions: sessionmaker[Session]
    waiting: Callable[[int], list[str]] = none_waits
    """Codes of the buildings whose sources are polled next, at most so many."""
    _read: dict[str, tuple[float, Line]] = field(default_factory=dict)
    """By the building's code: s of the timer, and the answer of `polled`."""
    _reading: Lock = field(default_factory=Lock)
    _ended: dict[int, tuple[float, Mapping[str, object]]] = field(default_factory=dict)
    """By the building's number: s of the timer, and columns of its source's state that are not stored yet."""
    _ending: Lock = field(default_factory=Lock)

    def found(self, code: str, now: datetime) -> Line | None:
        """A building and the state of its source, as `polled` selects them; None if there is no such building."""
        with self._reading:
            self._forget_old()
            if code in self._read:
                return self._read.pop(code)[1]
            codes = [code, *(one for one in self.waiting(MANY) if one not in self._read)]
            with reading(self.sessions)() as session:
                asked = {"codes": codes, "past": now + CLOCK_SLACK}
                lines = {one.Building.code: one for one in session.execute(polled(), asked)}
            self._read.update({one: (monotonic(), line) for one, line in lines.items() if one != code})
            return lines.get(code)

    def ended(self, number: int, columns: Mapping[str, object]) -> None:
        """Store how a quiet poll ended, now or together with later ones.

        Args:
            number: of the building, whose source has a state already.
            columns: values of the state's columns.
        """
        with self._ending:
            self._ended[number] = monotonic(), columns
            oldest = min(since for since, _ in self._ended.values())
            is_due = len(self._ended) >= MANY or monotonic() - oldest > LATEST
        if is_due or not self.waiting(1):
            self.store()

    def forget(self, number: int) -> None:
        """Discard an end that is not stored yet: a later poll of the same source has news."""
        with self._ending:
            self._ended.pop(number, None)

    def store(self) -> None:
        """Store the ends that are not stored yet."""
        with self._ending:  # until it is done: a later end of the same source must not be overwritten by an earlier one
            if not self._ended:
                return
            rows = defaultdict[tuple[str, ...], list[dict[str, object]]](list)
            for number, (_, columns) in sorted(self._ended.items()):
                rows[tuple(columns)].append({"number": number, **columns})
            with self.sessions.begin() as session:
                for names, alike in rows.items():
                    session.connection().execute(end(names), alike)
            self._ended.clear()

    def _forget_old(self) -> None:
        for code in [code for code, (since, _) in self._read.items() if monotonic() - since >= FRESH]:
            del self._read[code]


@cache
def end(columns: Collection[str]) -> Update:
    """Sets columns of the source's state of the building `number`.

    The statement is made once, and passes the session's objects by: a quiet poll takes little else.
    """
    table = Base.metadata.tables[SourceState.__tablename__]
    of_building = update(table).where(table.c.building_id == bindparam("number"))
    return of_building.values({name: bindparam(name) for name in columns})


@cache
def polled() -> Question:
    """(Building, Revision, SourceState | None, is_to_read, is_to_read_again) of the buildings of `codes`.

    What was rejected as of the future is to be read again if it ends by `past`.
    """
    number = Recording.building_id == Building.id
    return (
        latest_revision()
        .add_columns(
            SourceState,
            exists().where(number, STORED).label("is_to_read"),
            or_(*(exists().where(number, *again) for again in (FAILED_BEFORE, past_by(bindparam("past"))))).label(
                "is_to_read_again"
            ),
        )
        .outerjoin(SourceState, SourceState.building_id == Building.id)
        .where(Building.code.in_(bindparam("codes", expanding=True)))
    )
