"""What came of an attempt to deliver?"""

from dataclasses import dataclass
from typing import Literal

Outcome = Literal["delivered", "not_taken", "unknown"]
"""`unknown`: the receiver may have it, but did not say so."""

LONGEST = 500
"""Characters of an answer that are kept."""


@dataclass(frozen=True, slots=True)
class Answer:
    """The end of an attempt."""

    outcome: Outcome
    text: str
    """What the receiver said, or what went wrong, in one line and without a secret."""
    is_final: bool = False
    """Whether trying again would be of no use."""


def one_line(text: str) -> str:
    """What a receiver said, as it may be kept and shown."""
    line = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return line if len(line) <= LONGEST else line[: LONGEST - 1] + "…"
