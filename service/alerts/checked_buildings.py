"""Results of each building's last check in the database: a poller that starts checks only what has changed.

Stored are buildings about which nothing was to be written and that have no open data alert, which are nearly all. Their
facts are kept as a digest: while it is that of the facts of now, the last check stands, as within one process.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from hashlib import sha256
from typing import Any

from sqlalchemy import delete, select
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from service.alerts.building_states import BuildingState
from service.alerts.candidates import AlertCandidate
from service.alerts.tables import BuildingCheck
from service.settings import Settings


@dataclass(frozen=True, slots=True)
class Known:
    """Facts about a building that change with its description and its events only."""

    has_source: bool
    is_continuous: bool
    described_at: datetime
    """Time when its description took effect."""
    dead_channels: tuple[AlertCandidate, ...]
    streamed: frozenset[str] | None
    """Channels of its live stream, none without one; None where the database does not keep this with the check."""


@dataclass(frozen=True, slots=True)
class Checked:
    """A building at its last check: nothing is done again while it is the same, unless the clock was set back."""

    checked_at: datetime
    state: BuildingState
    known: Known
    began: Mapping[str, datetime]
    """Beginning of each open data alert, by cause."""
    candidates: tuple[AlertCandidate, ...]
    expires_at: datetime
    """Time of the next full check, even if the building is the same: a reminder may be due then."""
    is_settled: bool
    """True if there was nothing to write."""

    @property
    def is_quiet(self) -> bool:
        """True if there was nothing to write, and there is no alert about data, open or about to be."""
        return self.is_settled and not (self.began or self.candidates or self.known.dead_channels)


def read(session: Session, states: Mapping[int, BuildingState], settings: Settings) -> dict[int, Checked]:
    """The last check of each building that was quiet then and whose facts are the same now, in one statement."""
    found = {}
    for row in session.execute(select(BuildingCheck.__table__)):
        state = states.get(row.building_id)
        if state is not None and _digest(state, settings) == row.facts:
            known = Known(row.has_source, row.is_continuous, row.described_at, (), None)
            found[row.building_id] = Checked(row.checked_at, state, known, {}, (), row.expires_at, is_settled=True)
    return found


def store(session: Session, checks: Mapping[int, Checked], settings: Settings) -> None:
    """Keep these last checks in place of earlier ones of the same buildings, if they were quiet."""
    session.execute(delete(BuildingCheck).where(BuildingCheck.building_id.in_(checks)))
    rows = [
        {
            "building_id": number,
            "checked_at": one.checked_at,
            "expires_at": one.expires_at,
            "facts": _digest(one.state, settings),
            "has_source": one.known.has_source,
            "is_continuous": one.known.is_continuous,
            "described_at": one.known.described_at,
        }
        for number, one in checks.items()
        if one.is_quiet
    ]
    if rows:
        dialect: Any = postgresql if session.get_bind().dialect.name == "postgresql" else sqlite
        session.execute(dialect.insert(BuildingCheck).values(rows).on_conflict_do_nothing())


def _digest(state: BuildingState, settings: Settings) -> str:
    """SHA-256 of the facts and the settings that decide what a check writes."""
    deciding = (settings.data_health.channel_misses, settings.notify.reminder_interval, settings.notify.max_event_age)
    return sha256(repr((state.events, state.news, deciding)).encode()).hexdigest()
