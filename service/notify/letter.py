"""What is sent to one receiver in one attempt?"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any
from zoneinfo import ZoneInfo

DRILL = "DRILL – NOT REAL"
TEST = "TEST – NOT REAL"
ORDER = {"new": "", "updated": "UPDATED: ", "cancelled": "CANCELLED: ", "repeat": "REMINDER: "}
GRADES = {"normal": "normal", "note": "note", "warning": "warning", "alarm": "ALARM"}
"""Severities as people read them."""
NOT_REAL = {
    "drill": "This is a drill. Nothing has happened at the building, and nobody has to do anything about it.",
    "test": "This is a test of the way of the messages. Nothing has happened at the building.",
}
AGAIN = (
    "This may reach you for the second time: it was sent before, and whether it arrived is not known. The message's "
    "number below is the same in both."
)


@dataclass(frozen=True, slots=True)
class Letter:
    """A message on its way to one receiver."""

    identity: str
    first_identity: str
    """Of the first message of its key."""
    key: str
    number: int
    building_code: str
    building_name: str
    timezone: str
    """IANA name."""
    kind: str
    sequence: str
    severity: str
    gravest: str
    """Severity by which programs know the thing: the last one of a message that was not over."""
    subject: str
    sentences: tuple[str, ...]
    facts: tuple[tuple[str, str], ...]
    link: str
    """Address of the page that has more; empty where nobody said how the pages are reached."""
    data: Mapping[str, Any]
    began_at: datetime
    """When the first message of its key was written."""
    written_at: datetime
    is_repeat: bool
    """Whether it may be the second of its kind."""
    picture: bytes | None = None
    """PNG."""
    has_ended: bool = False
    """Whether what it is about has ended, as it was written."""
    standing_since: datetime | None = None
    """Since when what it reports is open, where its reader became a recipient later than it was written; else None."""
    standing: str = ""
    """What that reader must know first; empty for all others."""

    @property
    def is_over(self) -> bool:
        """Whether what it is about no longer holds."""
        return self.has_ended or self.sequence == "cancelled"

    @property
    def is_real(self) -> bool:
        """Whether it tells of the building, and not of the way of the messages."""
        return self.kind not in NOT_REAL

    @property
    def heading(self) -> str:
        """Its subject in one line, with all that must be known before the first word of it."""
        marks = ("(repeat) " if self.is_repeat else "") + {"drill": f"{DRILL}: ", "test": f"{TEST}: "}.get(
            self.kind, ""
        )
        return f"{marks}{self.order}[{self.building_name}] {' '.join(self.subject.split())}"

    @property
    def order(self) -> str:
        """How it follows earlier ones, before its subject."""
        if self.standing_since is None:
            return ORDER[self.sequence]
        return f"OPEN SINCE {self.standing_since.astimezone(ZoneInfo(self.timezone)):%Y-%m-%d}: "

    @property
    def paragraphs(self) -> tuple[str, ...]:
        """All sentences, those that must not be missed first."""
        return (
            *([NOT_REAL[self.kind]] if not self.is_real else []),
            *([self.standing] if self.standing else []),
            *self.sentences,
            *([AGAIN] if self.is_repeat else []),
        )

    @property
    def written(self) -> str:
        """When it was written, as people at the building read it."""
        local = self.written_at.astimezone(ZoneInfo(self.timezone))
        return f"{local:%Y-%m-%d %H:%M:%S} ({self.timezone})"

    @property
    def text(self) -> str:
        """All of it as plain text."""
        widest = max((len(name) for name, _ in self.facts), default=0)
        facts = "\n".join(f"{name:<{widest}}  {value}" for name, value in self.facts)
        more = f"More: {self.link}" if self.link else ""
        parts = (*self.paragraphs, facts, more, f"{self.written}, message {self.identity}")
        return "\n\n".join(part for part in parts if part) + "\n"


@dataclass(frozen=True, slots=True)
class Addressee:
    """Where a letter goes; what it holds is shown nowhere."""

    name: str
    kind: str
    address: str = field(repr=False)
    secret: str | None = field(repr=False)
