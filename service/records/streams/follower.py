"""One building's live stream: packets are kept, earthquakes are cut out of them, and the connection is kept up."""

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from importlib import import_module
from threading import Event as Signal
from time import monotonic
from typing import Any

from sqlalchemy import select
from sqlalchemy.exc import InterfaceError, OperationalError
from sqlalchemy.orm import Session, sessionmaker

from service import parsing
from service.buildings.description import BuildingFile, SourceFile
from service.buildings.locking import locked
from service.buildings.tables import Building
from service.db import process_leases
from service.db.problems import undone
from service.db.sessions import reading
from service.errors import StoreAwayError
from service.formats import FormatError, Gain, Trace, UnknownUnitError
from service.jobs import queue as job_queue
from service.parsing import ParserDiedError, ParserFailedError
from service.records import events
from service.records.continuous import trigger_settings
from service.records.recordings import gains
from service.records.source_poller import SourcePoller, source_state
from service.records.sources.source import Arrival, SourceError
from service.records.streams import earthquakes, flow, ring
from service.records.streams.earthquakes import Cut, Shaking
from service.records.streams.packets import Packet, examined, traces
from service.records.streams.seedlink import Connection, Received, Server
from service.records.tables import Event, StreamState
from service.records.trigger import TriggerSettings, Window
from service.settings import Settings

log = logging.getLogger(__name__)

LEASE = "stream/"
"""Beginning of the lease of a building's stream, before the building's code."""
LEASE_TIME = timedelta(seconds=60)
"""Time after which the stream of a silent process goes to another one. Not tuned."""
RENEWAL = 15.0
"""s between two renewals of the lease, and two looks for new gains and packets that are too old."""
WAIT = 1.0
"""s for which packets are collected at most before they are kept."""
LOOK = 2.0
"""s between two looks at the packets by the trigger, or SHARE times as long as the last one took."""
SHARE = 2
SETTLED = timedelta(seconds=5)
"""Time without a late packet after which an earthquake is cut anew, with those that came. Not tuned."""
CLOCK_MOVED = 60.0
"""s by which the clock must have been set ahead for packets of the future to be examined again. Not tuned."""
EXAMINED = 1000
"""Packets that are examined again at each look. Not tuned."""
RETRY, LONGEST_RETRY = 1.0, 60.0
"""s before a second connection, which double up to the longest."""


Announce = Callable[[Session, Building, BuildingFile, Event, Shaking], None]
"""Announces an earthquake that is not over, within the transaction that stores it."""


class TakenError(Exception):
    """Another process follows the stream."""


@dataclass(slots=True)
class Follower:
    """Follows the stream of one building until `stop` is set."""

    sessions: sessionmaker[Session]
    settings: Settings
    building: Building
    described: BuildingFile
    source: SourceFile
    holder: str
    clock: Callable[[], datetime]
    announce: Announce = lambda session, building, described, event, shaking: None
    stop: Signal = field(default_factory=Signal)
    gains: Mapping[str, Gain] = field(default_factory=dict)
    renewed: float = -float("inf")
    looked: float = -float("inf")
    took: float = 0.0
    """s that the last look took."""
    failures: int = 0
    """Looks in a row that failed."""
    lead: float = -float("inf")
    """s, lead of the clock over the timer when packets of the future were last searched, or at its least since."""
    past: list[int] = field(default_factory=list)
    """Ids of packets to be examined again: they were rejected as of the future and no longer are."""

    def run(self) -> None:
        """Connect, follow, and connect anew where the connection ends; nothing but `stop` ends it."""
        import_module("obspy.signal.trigger")  # it takes seconds, which the first earthquake should not wait for
        failures = 0
        while not self.stop.is_set():
            begun = monotonic()
            with self._logged():
                try:
                    self.follow()
                except TakenError:
                    self.stop.wait(LEASE_TIME.total_seconds() / 4)
                except SourceError as error:
                    self._failed(str(error))
            failures = 0 if monotonic() - begun > LONGEST_RETRY else failures + 1
            self.stop.wait(min(RETRY * 2.0 ** min(failures - 1, 16), LONGEST_RETRY) if failures else RETRY)
        with self._logged(), self.sessions.begin() as session:
            process_leases.give_up(session, LEASE + self.building.code, self.holder)

    @contextmanager
    def _logged(self) -> Iterator[None]:
        """Survive a database that is away or undoes a transaction, and a bug, which must not stop a stream for ever."""
        try:
            yield
        except (OperationalError, InterfaceError) as error:
            if reason := undone(error):
                log.warning("a transaction of the stream of %s is repeated, because %s", self.building.code, reason)
            else:
                log.warning("the stream of %s waits for the database: %s", self.building.code, type(error).__name__)
        except StoreAwayError:  # which has logged it
            log.warning("the stream of %s waits for the store of original files", self.building.code)
        except Exception:  # it is logged each time
            log.exception("following the stream of %s failed", self.building.code)

    def follow(self) -> None:
        """One connection, from the position in the database on.

        Raises:
            SourceError: it cannot be made, has ended, or brings nothing.
            TakenError: another process follows the stream.
        """
        position = self.hold()
        channels = [channel.id for channel in self.described.description.channels]
        connection = Connection(self.source.location, channels, position, self.settings.polling.timeout)
        try:
            self._receive(connection)
        finally:
            connection.close()

    def _receive(self, connection: Connection) -> None:
        heard, is_known = monotonic(), False
        while not self.stop.is_set():
            came = connection.packets(WAIT)
            if connection.server is not None and (came or not is_known):
                self.keep(connection.server, came, is_new=not is_known)
                is_known, heard = True, monotonic() if came else heard
            if monotonic() - self.renewed > RENEWAL:
                self.hold()
            if monotonic() - self.looked > max(LOOK, SHARE * self.took):
                self.look()
            if (silence := monotonic() - heard) > self.settings.stream.silence:
                raise SourceError(f"{connection.address} has sent no packet for {silence:.0f} s")

    def hold(self) -> Mapping[str, Any]:
        """Acquire or renew the lease and remove old packets; returns the position.

        Raises:
            TakenError: another process has it.
        """
        now, keep = self.clock(), timedelta(seconds=self.settings.stream.keep)
        with self.sessions.begin() as session:
            if not process_leases.hold(session, LEASE + self.building.code, self.holder, now, LEASE_TIME):
                raise TakenError
            ring.trim(session, now - keep, now)
            state = stream_state(session, self.building.id)
            cuts = earthquakes.read_cuts(state.cuts)
            state.cuts = earthquakes.written_cuts(one for one in cuts if one.end > now - keep)
            position = dict(source_state(session, self.building).cursor)
        with reading(self.sessions)() as session:
            self.gains = gains(session, self.building, self.settings)
        self.renewed = monotonic()
        return position

    def keep(self, server: Server, came: Sequence[Received], *, is_new: bool = False) -> None:
        """Keep packets with the position behind them, in one transaction.

        Args:
            server: that sent them.
            came: the packets, of which it may have sent some before.
            is_new: True at the first packets of a connection.
        """
        now = self.clock()
        channels = self.described.description.channels
        packets = examined(came, channels, self.gains, parsing.limits(self.settings), now)
        with self.sessions.begin() as session:
            new = self._keep(session, packets, now)
            state = stream_state(session, self.building.id)
            if is_new:
                state.connected_since, state.protocol = now, server.protocol
                flows = flow.read(state.channels)
                requested = flow.of_channels(flows, [channel.id for channel in channels], now)
                state.channels = flow.written(flows | requested)  # a later connection does not hide a silent channel
            state.silent = flow.silent(state, self.described, now, timedelta(seconds=self.settings.stream.silence))
            source = source_state(session, self.building)
            source.cursor = _position(source.cursor, server, packets)
            source.attempted_at = source.looked_at = now
            if packets:
                if source.failing_since is not None:
                    log.warning("the stream of %s has recovered", self.building.code)
                source.succeeded_at, source.failing_since, source.error = now, None, None
                leads = [(one.end - now).total_seconds() for one in new if one.reason is None]
                source.clock_ahead = max(leads) if leads and max(leads) > 0 else None

    def _keep(self, session: Session, packets: Sequence[Packet], now: datetime) -> list[Packet]:
        """Keep and count packets; returns those that are new, or were rejected before and can be used now."""
        state = stream_state(session, self.building.id)
        mended = ring.mend(session, self.building, packets, now) if state.refused else {}
        digests = {*ring.keep(session, self.building, packets, now), *mended}
        new = [packet for packet in _first(packets) if packet.digest in digests]
        self._count(state, packets, new, now)
        if mended:  # they are looked at like new ones
            first = min(mended.values())
            state.packets -= len(mended)
            state.refused -= len(mended)
            state.looked = min(state.looked, first - 1)
            state.cuts = earthquakes.written_cuts(earthquakes.back_to(earthquakes.read_cuts(state.cuts), first))
        return new

    def _count(self, state: StreamState, packets: Sequence[Packet], new: Sequence[Packet], now: datetime) -> None:
        usable, refused = [one for one in new if one.reason is None], [one for one in new if one.reason is not None]
        state.packets += len(new)
        state.doubles += len(packets) - len(new)
        state.refused += len(refused)
        if refused:
            if state.problem != refused[-1].reason:
                log.warning("a packet of the stream of %s was rejected: %s", self.building.code, refused[-1].reason)
            state.problem = refused[-1].reason
        if packets:
            state.received_at = now
        state.channels = flow.written(flow.flowed(flow.read(state.channels), usable, now))

    def look(self) -> None:
        """Look at what came since the last look; cut out the earthquakes that are over.

        What the parser fails at is looked at again, as often as a job is attempted.
        """
        begun = monotonic()
        try:
            self._examine_again()
            self._look()
        except (FormatError, ParserDiedError, ParserFailedError) as error:
            self.failures += 1
            log.warning("the packets of %s cannot be read together: %s", self.building.code, error)
        else:
            self.failures = 0
        self.looked, self.took = monotonic(), monotonic() - begun

    def _examine_again(self) -> None:
        """Examine the next packets again that were rejected as of the future, once the clock was set ahead.

        The first look searches for them too, because the clock may have been set while no process followed the stream.
        """
        now = self.clock()
        lead = now.timestamp() - monotonic()
        with reading(self.sessions)() as session:
            if lead > self.lead + CLOCK_MOVED:
                self.past = self._past(session, now)
                self.lead = lead
            self.lead = min(self.lead, lead)
            came = ring.as_received(session, self.past[:EXAMINED]) if self.past else []
        channels, limits = self.described.description.channels, parsing.limits(self.settings)
        again = examined(came, channels, self.gains, limits, now)
        if usable := [packet for packet in again if packet.reason is None]:
            with self.sessions.begin() as session:
                self._keep(session, usable, now)
            log.warning("%d packets of %s are not of the future any more", len(usable), self.building.code)
        del self.past[:EXAMINED]

    def _past(self, session: Session, now: datetime) -> list[int]:
        state = session.get(StreamState, self.building.id)
        if state is None or not state.refused:
            return []
        return ring.past(session, self.building.id, now - timedelta(seconds=self.settings.stream.keep), now)

    def _look(self) -> None:
        now = self.clock()
        with reading(self.sessions)() as session:
            state = session.get(StreamState, self.building.id)
            if state is None:
                return
            new = ring.since(session, self.building.id, state.looked)
            last = max((one.id for one in new), default=state.looked)
            shaking, cuts = earthquakes.read_shaking(state.shaking), earthquakes.read_cuts(state.cuts)
            silence = now - state.received_at if state.received_at is not None else timedelta(0)
        cuts = earthquakes.with_late(cuts, new)
        known = [one.window for one in shaking]
        going, over = self._earthquakes(earthquakes.areas(new, known), known, cuts, silence)
        for cut in [one for one in cuts if one.late_since is not None and now - one.late_since >= SETTLED]:
            over.append(Window(cut.start, cut.end))
        for window in over:
            self._cut(window)
            cuts = [one for one in cuts if not (window.start <= one.start and one.end <= window.end)]
            cuts.append(Cut(window.start, window.end, last))
        with self.sessions.begin() as session:
            for one in going:
                if one.largest >= self.settings.stream.announced:
                    self._announce(session, one, now)
            state = stream_state(session, self.building.id)
            state.looked = last
            state.shaking = earthquakes.written_shaking(going)
            state.cuts = earthquakes.written_cuts(cuts)

    def _earthquakes(
        self,
        areas: Sequence[tuple[datetime, datetime]],
        shaking: Sequence[Window],
        cuts: Sequence[Cut],
        silence: timedelta,
    ) -> tuple[list[Shaking], list[Window]]:
        """The earthquakes that are not over, and those that are and were not cut out."""
        trigger, longest = self._trigger(), timedelta(seconds=self.settings.event.longest)
        memory, patience = earthquakes.memory(trigger), timedelta(seconds=self.settings.stream.patience)
        going: list[Shaking] = []
        over: list[Window] = []
        for start, end in areas:
            around = self._traces(start - memory, end + memory)
            windows = earthquakes.found(around, trigger, longest)
            known = [one for one in shaking if start <= one.end and one.start <= end]
            for window in [*windows, *(one for one in known if not _any_overlaps(windows, one))]:
                whole = earthquakes.joined(window, earthquakes.cut_at(cuts, window), longest)
                if whole is None or _any_overlaps([*over, *(one.window for one in going)], whole):
                    continue
                if earthquakes.is_over(whole, around, patience, silence):
                    over.append(whole)
                else:
                    going.append(Shaking(whole, earthquakes.peaks(around, whole)))
        return going, over

    def _traces(self, start: datetime, end: datetime) -> Sequence[Trace]:
        with reading(self.sessions)() as session:
            data = ring.between(session, self.building.id, start, end)
        if not data:
            return ()
        try:
            return traces(data, self.described.description.channels, self.gains, parsing.limits(self.settings))
        except UnknownUnitError:
            return ()
        except (FormatError, ParserDiedError, ParserFailedError):
            if self.failures + 1 < self.settings.jobs.attempts:
                raise
            log.warning("an earthquake in the packets of %s since %s would not be seen", self.building.code, start)
            return ()

    def _cut(self, window: Window) -> None:
        """Hand the packets of an earthquake to the intake, as a file; the same bytes are one file."""
        with reading(self.sessions)() as session:
            data = ring.between(session, self.building.id, window.start, window.end)
        name = f"{window.start:%Y%m%dT%H%M%S}-{window.end:%Y%m%dT%H%M%S}.mseed"
        arrival = Arrival(name=name, origin=self.source.location, data=data)
        if data:
            SourcePoller(self.sessions, self.settings, self.clock).receive(self.building, (arrival,))
        with self.sessions.begin() as session:
            for event in self._gathering(session, window):
                job_queue.enqueue(session, event, {}, self.clock())

    def _announce(self, session: Session, shaking: Shaking, now: datetime) -> None:
        """Make the event of an earthquake that is not over, and keep it from being queued without its records."""
        window, longest = shaking.window, timedelta(seconds=self.settings.event.longest)
        locked(session, self.building.id)
        event = events.at(session, self.building, window.start, window.end, now, longest)
        if event.state == "gathering":
            event.end, event.updated_at = max(event.end, window.end), now
            self.announce(session, self.building, self.described, event, shaking)

    def _gathering(self, session: Session, window: Window) -> Sequence[Event]:
        """The events of a window that are not queued: no further files will come."""
        within = (Event.building_id == self.building.id, Event.start <= window.end, Event.end >= window.start)
        waiting = select(Event).where(*within, Event.state == "gathering")
        return session.scalars(waiting.with_for_update(skip_locked=True)).all()

    def _trigger(self) -> TriggerSettings:
        return replace(trigger_settings(self.settings), after=timedelta(seconds=self.settings.stream.after))

    def _failed(self, error: str) -> None:
        with self.sessions.begin() as session:
            state = source_state(session, self.building)
            if state.failing_since is None:
                log.warning("the stream of %s begins to fail: %s", self.building.code, error)
                state.failing_since = self.clock()
            state.error, state.attempted_at, state.looked_at = error, self.clock(), self.clock()
            stream_state(session, self.building.id).connected_since = None
        self.look()


def stream_state(session: Session, building_id: int) -> StreamState:
    """The state of a building's stream, a new one at first."""
    state = session.get(StreamState, building_id)
    if state is None:
        state = StreamState(
            building_id=building_id, packets=0, doubles=0, refused=0, channels={}, looked=0, shaking=[], cuts=[]
        )
        session.add(state)
    return state


def _first(packets: Sequence[Packet]) -> list[Packet]:
    """The packets without those that came before among them."""
    first: dict[str, Packet] = {}
    for packet in packets:
        first.setdefault(packet.digest, packet)
    return list(first.values())


def _position(before: Mapping[str, Any], server: Server, packets: Sequence[Packet]) -> dict[str, Any]:
    """The cursor: the last sequence number of each station at this server."""
    same = {"address": server.address, "protocol": server.protocol}
    is_same = all(before.get(key) == value for key, value in same.items())
    stations = dict(before.get("stations", {})) if is_same else {}
    known = [one for one in packets if one.station in server.stations]
    stations |= {one.station: one.sequence for one in known if one.sequence is not None}
    return {**same, "stations": stations}


def _any_overlaps(windows: Sequence[Window], window: Window) -> bool:
    return any(one.start <= window.end and window.start <= one.end for one in windows)
