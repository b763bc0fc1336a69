"""Polling of a building's source: new files are stored, then read, and the state of the source is kept."""

import logging
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from time import monotonic, sleep
from typing import Any

from sqlalchemy import select
from sqlalchemy.exc import InterfaceError, OperationalError
from sqlalchemy.orm import Session, sessionmaker

from service import tracing
from service.buildings import store as building_store
from service.buildings.description import BuildingFile, SourceFile
from service.buildings.locking import locked
from service.buildings.tables import Building
from service.db.sessions import reading
from service.db.upsert import insert_into
from service.errors import StoreAwayError
from service.parsing import ParserDiedError
from service.records import events
from service.records.file_store import LostFileError
from service.records.ingest import (
    begin,
    next_stored,
    not_begun,
    parse,
    read_again_what_is_past,
    read_again_with_this_version,
    reading_failed,
    take_in,
)
from service.records.originals import Secured, secured
from service.records.polled_together import PolledTogether, none_waits
from service.records.recordings import Fetched, Units, refuse_unseen, remember, store, units_of
from service.records.sources.opening import opened
from service.records.sources.retried_requests import Manners, ServerClock
from service.records.sources.source import Arrival, Cursor, SourceError, Step
from service.records.tables import Recording, SourceState
from service.settings import Settings

log = logging.getLogger(__name__)

LONGEST_LOOK = 20
"""Times http_timeout: a longer poll ends between two steps, and the next one continues there."""


@dataclass(frozen=True, slots=True)
class Poll:
    """One poll of a building's source that is under way."""

    building: Building
    described: BuildingFile
    source: SourceFile
    state: SourceState | None
    """As it was before; None before the first poll."""
    begun_at: datetime
    server: ServerClock

    @property
    def is_known(self) -> bool:
        """True if the source was polled before."""
        return self.state is not None

    @property
    def was_failing(self) -> bool:
        """True if the poll before failed."""
        return self.state is not None and self.state.failing_since is not None

    @property
    def cursor(self) -> dict[str, Any]:
        """Where to continue."""
        return {} if self.state is None else self.state.cursor


@dataclass(frozen=True, slots=True)
class Begun:
    """A recording whose reading has begun."""

    recording: Recording
    units: Units | None
    """Sources of the units of its channels; None if they were not read yet."""


@dataclass(frozen=True, slots=True)
class SourcePoller:
    """Polls the sources of buildings."""

    sessions: sessionmaker[Session]
    settings: Settings
    clock: Callable[[], datetime] = lambda: datetime.now(UTC)
    sleep: Callable[[float], object] = sleep
    """Waits so many seconds between two attempts; True if no other attempt may follow."""
    stopped: Callable[[], bool] = lambda: False
    """Called between two steps: True ends the poll, and the next one continues there."""
    follow: Callable[[Building, BuildingFile, SourceFile], None] = lambda building, described, source: None
    """Called where the source is a live stream, which brings its packets by itself."""
    waiting: Callable[[int], list[str]] = none_waits
    """Codes of the buildings whose sources are polled next, at most so many."""
    interrupted: set[int] = field(default_factory=set)
    """Recordings whose reading was interrupted by the database, which is no failure of theirs."""
    together: PolledTogether = field(init=False)
    """The database's part of polls."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "together", PolledTogether(self.sessions, self.waiting))

    def poll_all(self) -> None:
        """Poll every building's source once."""
        with self.sessions() as session:
            codes = [building.code for building in session.query(Building).order_by(Building.code)]
        for code in codes:
            self.poll(code)
        self.queue_ready()

    def poll(self, code: str) -> bool:
        """Poll one building's source; that a source begins to fail is stored, and logged once.

        Returns:
            False if the source failed, or the store of original files could not take what it brought.

        Raises:
            StoreAwayError: files that came earlier cannot be read.
        """
        with tracing.span("poll", building=code):
            return self._poll(code)

    def _poll(self, code: str) -> bool:
        found = self.together.found(code, self.clock())
        if found is None:
            with self.sessions() as session:
                building_store.find(session, code)  # raises
            return True
        building, described = found.Building, building_store.parsed(found.Revision)
        if found.is_to_read_again:
            with self.sessions.begin() as session:
                read_again_with_this_version(session, building)
                read_again_what_is_past(session, building, self.clock())
        if self.stopped():
            return True
        if found.is_to_read_again or found.is_to_read:  # stored by an interrupted poll, or readable by now
            with self.sessions.begin() as session:
                first = self._next_begun(session, locked(session, building.id))
            self._read(building, first)
        if described.source is None or self.stopped():
            return True
        if described.source.kind == "seedlink":
            self.follow(building, described, described.source)
            return True
        poll = Poll(building, described, described.source, found.SourceState, self.clock(), ServerClock(self.clock))
        try:
            cursor = self._follow(poll)
        except (SourceError, StoreAwayError) as error:  # the position stays, so that the files come again
            self._failed(poll, str(error))
            return False
        self._succeeded(poll, {} if cursor is None else {"cursor": dict(cursor)})
        return True

    def note_attempt(self, code: str, since: datetime) -> None:
        """Store that a poll has begun and has not ended: a quick one is stored when it ends."""
        with self.sessions.begin() as session:
            building = session.scalar(select(Building).where(Building.code == code))
            if building is None:
                return
            state = source_state(session, building)
            if state.attempted_at is None or state.attempted_at < since:
                state.attempted_at = since

    def receive(self, building: Building, arrivals: tuple[Arrival, ...]) -> list[Recording]:
        """Store files, and read them only once they are safe; every file takes this path."""
        there = self._secured(arrivals)
        with self.sessions.begin() as session:
            recordings = [self._store(session, building, *one) for one in zip(arrivals, there, strict=True)]
            first = self._next_begun(session, building)
        self._read(building, first, there)
        with self.sessions() as session:
            return [session.get_one(Recording, recording.id) for recording in recordings]

    def queue_ready(self) -> None:
        """Queue the events that have waited long enough."""
        with reading(self.sessions)() as session:
            if not events.is_any_ready(session, self.clock(), settings=self.settings):
                return
        with self.sessions.begin() as session:
            events.queue_ready(session, self.clock(), settings=self.settings)

    def _follow(self, poll: Poll) -> Cursor | None:
        """Store what the source brings, step by step.

        Returns:
            The position behind a last step that brought no file, to be stored with the end of the poll; None if the
            position is stored. Without it, that step would only be repeated.
        """
        memory, manners = Fetched(self.sessions, poll.building.id), self._manners(poll.was_failing)
        with opened(poll.described, poll.source, self.settings, memory, manners, poll.server.note) as source_of_files:
            cursor, quiet = poll.cursor, None
            try:
                for step in source_of_files.steps(cursor, self.clock()):
                    if step.arrivals or step.files:
                        self._take(poll, step)
                        cursor, quiet = dict(step.cursor), None
                    elif dict(step.cursor) != cursor:
                        if quiet is not None:
                            self._take(poll, quiet)
                        cursor, quiet = dict(step.cursor), step
                    if self.stopped() or manners.is_over:
                        break
            except (SourceError, StoreAwayError):
                if quiet is not None:
                    self._take(poll, quiet)
                raise
        return None if quiet is None else quiet.cursor

    def _manners(self, is_failing: bool) -> Manners:
        """Requests to a failing source are not repeated: it is tried again at the next poll."""
        given = self.settings
        retries = 0 if is_failing else given.polling.retries
        return Manners(self.sleep, retries, monotonic() + LONGEST_LOOK * given.polling.timeout)

    def _take(self, poll: Poll, step: Step) -> None:
        there, building, first = self._secured(step.arrivals), poll.building, None
        self.together.forget(building.id)
        with self.sessions.begin() as session:
            for one in zip(step.arrivals, there, strict=True):
                self._store(session, building, *one)
            remember(session, building, step.files)
            set_source_state(session, building, {"cursor": dict(step.cursor), "looked_at": self.clock()})
            if step.arrivals:
                first = self._next_begun(session, building, units=units_of(session, building, poll.described))
        if step.arrivals:
            self._read(building, first, there)

    def _secured(self, arrivals: Sequence[Arrival]) -> list[Secured | None]:
        """The bytes of the files that were fetched, safe before a transaction begins."""
        return [None if one.data is None else secured(one.data, self.settings.storage) for one in arrivals]

    def _store(self, session: Session, building: Building, arrival: Arrival, data: Secured | None) -> Recording:
        name, origin, now = arrival.name, arrival.origin, self.clock()
        if data is None:
            log.warning("%s of %s was rejected: %s", name, building.code, arrival.refusal)
            return refuse_unseen(session, building, name, origin, arrival.refusal or "not fetched", now)
        return store(session, building, name, origin, data, now)

    def _next_begun(
        self, session: Session, building: Building, failed: Collection[int] = (), units: Units | None = None
    ) -> Begun | None:
        """The building's next recording, with the attempt at reading it counted; None if no other is to be read.

        An attempt is counted in the transaction that stores the file, or ends the reading of the one before: the file
        is read as soon as that is committed.
        """
        while (recording := next_stored(session, building, failed)) is not None:
            if recording.id in self.interrupted:
                not_begun(recording)
            if begin(session, recording, settings=self.settings):
                return Begun(recording, units)
        return None

    def _read(self, building: Building, first: Begun | None, there: Sequence[Secured | None] = ()) -> None:
        """Read the stored files, each in a transaction of its own, so that a failure does not block the others.

        Those that are left when the poller is to stop are read by the next poll.

        Args:
            building: whose files they are.
            first: the first one; None if there is none.
            there: files that were just stored, whose bytes need not be read again.
        """
        at_hand = {one.sha256: one.data for one in there if one is not None}
        failed: list[int] = []
        begun = first
        while begun is not None:
            number = begun.recording.id  # which a rollback would hide
            self.interrupted.discard(number)
            if self.stopped():
                self._leave(number)
                return
            try:
                begun = self._read_one(building, begun, at_hand, failed)
            except (OperationalError, InterfaceError):  # the database is away
                self.interrupted.add(number)
                raise
            except StoreAwayError:
                self._leave(number)
                raise
            except Exception as error:  # the only place that survives a bug
                if isinstance(error, ParserDiedError | LostFileError):
                    log.warning("recording %d of %s: %s", number, building.code, error)
                else:
                    log.exception("reading recording %d of %s failed", number, building.code)
                failed.append(number)
                with self.sessions.begin() as session:
                    locked(session, building.id)  # before two of its recordings change
                    reading_failed(session.get_one(Recording, number), error, settings=self.settings)
                    begun = self._next_begun(session, building, failed)

    def _leave(self, number: int) -> None:
        """Leave a recording that was begun to a later poll."""
        with self.sessions.begin() as session:
            not_begun(session.get_one(Recording, number))

    def _read_one(
        self, building: Building, begun: Begun, at_hand: Mapping[str, bytes], failed: Collection[int]
    ) -> Begun | None:
        """Parse the bytes while no writer waits, take in their contents, and begin the next recording."""
        recording, given = begun.recording, self.settings
        with reading(self.sessions)() as session:
            parsed = parse(session, recording, settings=given, units=begun.units, at_hand=at_hand)
        with self.sessions.begin() as session:
            session.add(recording)
            units = take_in(session, recording, parsed, self.clock(), settings=given)
            if recording.state == "refused":
                log.warning("%s of %s was rejected: %s", recording.name, building.code, recording.reason)
            return self._next_begun(session, building, failed, units)

    def _failed(self, poll: Poll, error: str) -> None:
        now = self.clock()
        if not poll.was_failing:
            log.warning("the source of %s begins to fail: %s", poll.building.code, error)
        since = poll.state.failing_since if poll.state is not None and poll.was_failing else now
        self._end(poll, failing_since=since, error=error, looked_at=now)

    def _succeeded(self, poll: Poll, position: Mapping[str, object]) -> None:
        if poll.was_failing:
            log.warning("the source of %s has recovered", poll.building.code)
        now, ahead = self.clock(), poll.server.ahead
        lead = None if ahead is None else ahead.total_seconds()
        works = {"failing_since": None, "error": None, "succeeded_at": now, "clock_ahead": lead}
        self._end(poll, looked_at=now, **works, **position)

    def _end(self, poll: Poll, **columns: object) -> None:
        """Store how a poll ended, at once if it is news that the source fails, or works."""
        new = {"attempted_at": poll.begun_at, **columns}
        if poll.is_known and not poll.was_failing and columns["error"] is None:
            self.together.ended(poll.building.id, new)
            return
        self.together.forget(poll.building.id)
        with self.sessions.begin() as session:
            set_source_state(session, poll.building, new)


def source_state(session: Session, building: Building) -> SourceState:
    """The state of a building's source, a new one at first; another transaction may add it at the same time."""
    state = session.get(SourceState, building.id)
    if state is not None:
        return state
    session.execute(
        insert_into(session, SourceState).values(building_id=building.id, cursor={}).on_conflict_do_nothing()
    )
    return session.get_one(SourceState, building.id)


def set_source_state(session: Session, building: Building, columns: Mapping[str, object]) -> None:
    """Set columns of the state of a building's source, which may be a new one."""
    new = insert_into(session, SourceState)
    of_building = {"index_elements": ["building_id"], "set_": {name: new.excluded[name] for name in columns}}
    session.execute(new.on_conflict_do_update(**of_building), [{"building_id": building.id, "cursor": {}, **columns}])
