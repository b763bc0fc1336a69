"""Polling of a building's source: new files are stored, then read, and the state of the source is kept."""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from time import monotonic, sleep
from typing import Any

from sqlalchemy.exc import InterfaceError, OperationalError
from sqlalchemy.orm import Session, sessionmaker

from service import logs
from service.buildings import store as building_store
from service.buildings.description import BuildingFile, SourceFile
from service.buildings.tables import Building
from service.db.sessions import reading
from service.parsing import ParserDiedError
from service.records import events
from service.records.ingest import (
    begin,
    failed_before,
    next_stored,
    parse,
    read_again_with_this_version,
    reading_failed,
    take_in,
)
from service.records.recordings import Fetched, refuse_unseen, remember, store
from service.records.sources.opening import opened
from service.records.sources.retried_requests import Manners, ServerClock
from service.records.sources.source import Arrival, SourceError, Step
from service.records.tables import Recording, SourceState
from service.settings import Settings

log = logging.getLogger(__name__)

LONGEST_LOOK = 20
"""Times http_timeout: a longer poll ends between two steps, and the next one continues there."""


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
            False if the source failed.
        """
        with logs.about(building=code):
            return self._poll(code)

    def _poll(self, code: str) -> bool:
        with self.sessions() as session:
            building = building_store.find(session, code)
            described, state = building_store.described(session, building), session.get(SourceState, building.id)
            cursor, is_failing = ({}, False) if state is None else (state.cursor, state.failing_since is not None)
            is_to_read_again = failed_before(session, building)
        if is_to_read_again:
            with self.sessions.begin() as session:
                read_again_with_this_version(session, building)
        self._read(building)  # files stored by an interrupted poll, or readable with a new description
        if described.source is None:
            return True
        if described.source.kind == "seedlink":
            self.follow(building, described, described.source)
            return True
        self._remember(building, attempted_at=self.clock())
        server = ServerClock(self.clock)
        try:
            self._follow(building, described, described.source, cursor, server, self._manners(is_failing))
        except SourceError as error:
            self._failed(building, str(error))
            return False
        self._succeeded(building, server)
        return True

    def receive(self, building: Building, arrivals: tuple[Arrival, ...]) -> list[Recording]:
        """Store files, and read them only once they are safe; every file takes this path."""
        with self.sessions.begin() as session:
            recordings = [self._store(session, building, arrival) for arrival in arrivals]
        self._read(building)
        with self.sessions() as session:
            return [session.get_one(Recording, recording.id) for recording in recordings]

    def queue_ready(self) -> None:
        """Queue the events that have waited long enough."""
        with reading(self.sessions)() as session:
            if not events.is_any_ready(session, self.clock(), settings=self.settings):
                return
        with self.sessions.begin() as session:
            events.queue_ready(session, self.clock(), settings=self.settings)

    def _follow(
        self,
        building: Building,
        described: BuildingFile,
        source: SourceFile,
        cursor: dict[str, Any],
        server: ServerClock,
        manners: Manners,
    ) -> None:
        memory = Fetched(self.sessions, building.id)
        with opened(described, source, self.settings, memory, manners, server.note) as source_of_files:
            for step in source_of_files.steps(cursor, self.clock()):
                self._take(building, step)
                if self.stopped() or manners.is_over:
                    return

    def _manners(self, is_failing: bool) -> Manners:
        """Requests to a failing source are not repeated: it is tried again at the next poll."""
        given = self.settings
        retries = 0 if is_failing else given.polling.retries
        return Manners(self.sleep, retries, monotonic() + LONGEST_LOOK * given.polling.timeout)

    def _take(self, building: Building, step: Step) -> None:
        with self.sessions.begin() as session:
            for arrival in step.arrivals:
                self._store(session, building, arrival)
            remember(session, building, step.files)
            state = source_state(session, building)
            state.cursor, state.looked_at = dict(step.cursor), self.clock()
        if step.arrivals:
            self._read(building)

    def _store(self, session: Session, building: Building, arrival: Arrival) -> Recording:
        name, origin, now = arrival.name, arrival.origin, self.clock()
        if arrival.data is None:
            log.warning("%s of %s was rejected: %s", name, building.code, arrival.refusal)
            return refuse_unseen(session, building, name, origin, arrival.refusal or "not fetched", now)
        return store(session, building, name, origin, arrival.data, now)

    def _read(self, building: Building) -> None:
        """Read the stored files, each in a transaction of its own, so that a failure does not block the others."""
        failed: list[int] = []
        while (recording := self._next_stored(building, failed)) is not None:
            with self.sessions.begin() as session:
                if not begin(session, session.get_one(Recording, recording.id), settings=self.settings):
                    continue
            try:
                self._read_one(recording)
            except (OperationalError, InterfaceError):  # the database is away
                raise
            except Exception as error:  # the only place that survives a bug
                if isinstance(error, ParserDiedError):
                    log.warning("recording %d of %s: %s", recording.id, building.code, error)
                else:
                    log.exception("reading recording %d of %s failed", recording.id, building.code)
                failed.append(recording.id)
                with self.sessions.begin() as session:
                    reading_failed(session.get_one(Recording, recording.id), error, settings=self.settings)

    def _read_one(self, recording: Recording) -> None:
        """Parse the bytes while no writer waits, then take in their contents."""
        with reading(self.sessions)() as session:
            parsed = parse(session, session.get_one(Recording, recording.id), settings=self.settings)
        with self.sessions.begin() as session:
            waiting = session.get_one(Recording, recording.id)
            take_in(session, waiting, parsed, self.clock(), settings=self.settings)
            if waiting.state == "refused":
                log.warning("%s of %s was rejected: %s", waiting.name, waiting.building.code, waiting.reason)

    def _next_stored(self, building: Building, passed: list[int]) -> Recording | None:
        with reading(self.sessions)() as session:
            return next_stored(session, building, passed)

    def _failed(self, building: Building, error: str) -> None:
        with self.sessions.begin() as session:
            state = source_state(session, building)
            if state.failing_since is None:
                log.warning("the source of %s begins to fail: %s", building.code, error)
                state.failing_since = self.clock()
            state.error, state.looked_at = error, self.clock()

    def _succeeded(self, building: Building, server: ServerClock) -> None:
        with self.sessions.begin() as session:
            state = source_state(session, building)
            if state.failing_since is not None:
                log.warning("the source of %s has recovered", building.code)
            state.succeeded_at = state.looked_at = self.clock()
            state.failing_since, state.error = None, None
            state.clock_ahead = None if server.ahead is None else server.ahead.total_seconds()

    def _remember(self, building: Building, attempted_at: datetime) -> None:
        with self.sessions.begin() as session:
            source_state(session, building).attempted_at = attempted_at


def source_state(session: Session, building: Building) -> SourceState:
    """The state of a building's source, a new one at first."""
    state = session.get(SourceState, building.id)
    if state is None:
        state = SourceState(building_id=building.id, cursor={})
        session.add(state)
    return state
