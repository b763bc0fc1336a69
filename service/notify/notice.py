"""What is there to tell?"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from service.buildings.recipient_rules import Severity

Kind = Literal["event", "alert", "data", "drill", "test"]
"""An earthquake, an alert on the building or its sensors, data that stopped, a drill, a test of one receiver."""
Sequence = Literal["new", "updated", "cancelled", "repeat"]
"""`repeat` reminds of what still holds; that a delivery is tried again is not said here."""


@dataclass(frozen=True, slots=True)
class Notice:
    """Something to be told to the receivers of a building."""

    key: str
    """What it is about: `event/17`, `alert/5`. Messages of one key follow each other in one thread."""
    building_id: int
    kind: Kind
    sequence: Sequence
    severity: Severity
    """`normal` only by a verdict of that level."""
    subject: str
    """One line, without the building's name: that is put before it."""
    sentences: tuple[str, ...]
    """One paragraph each, for people who are no engineers."""
    facts: tuple[tuple[str, str], ...] = ()
    """Name and value with its unit as people read it, in order."""
    link: str = ""
    """Path on our server of the page that has more."""
    picture: tuple[int, str] | None = None
    """Event and direction whose loop is shown."""
    data: Mapping[str, Any] = field(default_factory=dict)
    """For programs, as JSON in SI units."""
    has_ended: bool = False
    """Whether nothing of what it is about stands any more."""
    news: "Notice | None" = None
    """What decides whether it says something else than the last message of its key; None: what people read of it."""

    @property
    def is_over(self) -> bool:
        """Whether what it is about no longer holds."""
        return self.has_ended or self.sequence == "cancelled"
