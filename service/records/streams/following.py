"""The live streams of a poller's share of the buildings, each followed in a thread of its own."""

import logging
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from datetime import datetime
from threading import Lock, Thread
from time import monotonic

from sqlalchemy.orm import Session, sessionmaker

from service.buildings.description import BuildingFile, SourceFile
from service.buildings.tables import Building
from service.records.streams.follower import Announce, Follower
from service.settings import Settings

log = logging.getLogger(__name__)

TO_END = 5.0
"""s given to the streams when the service stops; what had not been kept yet is requested again."""


@dataclass(slots=True)
class Streams:
    """The streams that this process follows."""

    sessions: sessionmaker[Session]
    settings: Settings
    holder: str
    clock: Callable[[], datetime]
    announce: Announce
    running: dict[str, tuple[Follower, Thread]] = field(default_factory=dict)
    """By code of the building."""
    lock: Lock = field(default_factory=Lock)
    is_ending: bool = False

    def follow(self, building: Building, described: BuildingFile, source: SourceFile) -> None:
        """Follow a building's stream; one that was described anew is begun anew."""
        with self.lock:
            had = self.running.get(building.code)
            if self.is_ending or (had is not None and had[0].described == described and had[1].is_alive()):
                return
            if had is not None:
                had[0].stop.set()
            follower = Follower(
                self.sessions, self.settings, building, described, source, self.holder, self.clock, self.announce
            )
            thread = Thread(target=follower.run, name=f"stream {building.code}", daemon=True)
            self.running[building.code] = follower, thread
            thread.start()

    def keep_only(self, codes: Collection[str]) -> None:
        """Stop the streams of other buildings."""
        with self.lock:
            for code in [code for code in self.running if code not in codes]:
                follower, _ = self.running.pop(code)
                follower.stop.set()

    def end(self) -> None:
        """Stop all streams, and wait a moment for them."""
        with self.lock:
            self.is_ending = True
            running = dict(self.running)
        for follower, _ in running.values():
            follower.stop.set()
        end = monotonic() + TO_END
        for _, thread in running.values():
            thread.join(max(end - monotonic(), 0.0))
        if left := sorted(code for code, (_, thread) in running.items() if thread.is_alive()):
            log.warning("stopped before the streams of %s had ended; no data is lost", ", ".join(left))
