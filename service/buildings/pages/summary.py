"""A building in short, for people: verdict, last earthquake, whom to call, and the state of its data apart from it."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

from sqlalchemy.orm import Session

from service.buildings import queries
from service.buildings.description import Contact
from service.records import queries as record_queries
from service.records.tables import SourceState
from service.verdict import reading, texts
from service.verdict.assessment import ACTIVE, CLOCKS, DATA, SENSORS, Assessment
from service.verdict.checks import Level, Outcome
from service.verdict.reading import Standing

OF_DATA = ("data", "sensor")
"""Kinds of alerts about records, not about the building."""


@dataclass(frozen=True, slots=True)
class Problem:
    """Something that is wrong with a building's data."""

    text: str
    address: str
    """Path of the page that shows it."""
    since: datetime | None = None


@dataclass(frozen=True, slots=True)
class Summary:
    """A building as a line of a list."""

    number: int
    code: str
    name: str
    verdict: Assessment
    reason: str
    """First reason of the level; empty where there is none."""
    event: int | None
    shaken_at: datetime | None
    zone: str
    """Time zone of the building."""
    moved: str
    """Largest displacement of the last earthquake; empty where it is not known."""
    contacts: Sequence[Contact]
    problems: Sequence[Problem]
    latitude: float | None
    longitude: float | None

    @property
    def level(self) -> Level:
        """Level of the verdict."""
        return self.verdict.level

    @property
    def passed(self) -> int:
        """Number of checks that were passed."""
        return len(self.verdict.of_outcome(Outcome.PASSED))

    @property
    def called(self) -> Contact | None:
        """The first person to call; None where nothing has to be done, or the building file names nobody."""
        return self.contacts[0] if self.contacts and self.level.rank >= Level.UNDECIDED.rank else None


def summaries(session: Session, buildings: Collection[int]) -> list[Summary]:
    """The buildings of these numbers, the worst level first, then by code; the statements are as many as for one."""
    made = _summaries(session, reading.standings(session, buildings))
    return sorted(made, key=lambda one: (-one.level.rank, one.code))


def summarised(session: Session, standing: Standing) -> Summary:
    """One building."""
    (made,) = _summaries(session, [standing])
    return made


def _summaries(session: Session, standings: Sequence[Standing]) -> list[Summary]:
    numbers = [one.building.id for one in standings]
    rejected = record_queries.rejected_counts(session, numbers)
    failing = {state.building_id: state for state in queries.failing_states(session, numbers)}
    return [_summary(one, failing.get(one.building.id), rejected) for one in standings]


def _summary(one: Standing, failing: SourceState | None, rejected: Mapping[int, int]) -> Summary:
    return Summary(
        number=one.building.id,
        code=one.building.code,
        name=one.building.name,
        verdict=one.verdict,
        reason=texts.reason(one.verdict),
        event=None if one.event is None else one.event.id,
        shaken_at=None if one.event is None else one.event.start,
        zone=one.file.timezone,
        moved=texts.moved(one.verdict),
        contacts=one.file.contacts,
        problems=tuple(_problems(one, failing, rejected.get(one.building.id, 0))),
        latitude=one.file.latitude,
        longitude=one.file.longitude,
    )


def _problems(one: Standing, failing: SourceState | None, rejected: int) -> Iterator[Problem]:
    records = f"/buildings/{one.building.code}/recordings"
    if one.verdict.unusable:
        yield Problem(one.verdict.unusable, records if one.event is None else f"/events/{one.event.id}")
    if failing is not None:
        error = f"The monitoring server has been failing: {failing.error or 'no reason was noted'}"
        yield Problem(error, records, failing.failing_since)
    if rejected:
        files = f"{rejected} file{'s' if rejected > 1 else ''} could not be used"
        yield Problem(files, f"{records}?state=rejected")
    for alert in one.verdict.alerts:
        if alert.kind in OF_DATA and alert.state in ACTIVE:
            yield Problem(alert.summary, f"/alerts/{alert.id}")
    told = {f"{alert.summary}." for alert in one.verdict.alerts}
    for check in one.verdict.checks:
        is_open = check.name in (DATA, SENSORS, CLOCKS) and check.outcome is Outcome.UNDECIDED
        if is_open and check.reason not in told and one.event is not None:
            yield Problem(check.reason, f"/events/{one.event.id}")
