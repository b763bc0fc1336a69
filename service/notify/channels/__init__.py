"""Channels of delivery: e-mail, webhooks, Alertmanager and chat services; and the result of an attempt."""

from dataclasses import dataclass
from typing import Literal

Outcome = Literal["delivered", "not_taken", "unknown"]
"""`not_taken`: not accepted, or not sent; `unknown`: the recipient may have it, but did not confirm it."""
LONGEST = 500
"""Characters of an answer that are stored."""


@dataclass(frozen=True, slots=True)
class DeliveryResult:
    """The result of an attempt to deliver."""

    outcome: Outcome
    text: str
    """The recipient's answer, or the error, in one line and without secrets."""
    is_final: bool = False
    """True if another attempt would be of no use."""


def one_line(text: str) -> str:
    """An answer as it may be stored and shown."""
    line = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return line if len(line) <= LONGEST else line[: LONGEST - 1] + "…"
