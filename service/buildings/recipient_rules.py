"""Rules of recipients: kinds, addresses, secrets and subscriptions."""

import base64
import binascii
import re
from dataclasses import dataclass, field
from typing import Literal, get_args
from urllib.parse import urlsplit

from service.language.choice import ENGLISH, Language

ReceiverKind = Literal["email", "webhook", "alertmanager", "apprise"]
WantedKind = Literal["event", "alert", "data", "drill"]
"""Kinds of messages: an earthquake, an alert on the building or its sensors, data that stopped, a drill."""
Severity = Literal["normal", "note", "warning", "alarm"]
"""From the least to the most."""

WANTED_KINDS: tuple[WantedKind, ...] = get_args(WantedKind)
SEVERITIES: tuple[Severity, ...] = get_args(Severity)
STANDING: tuple[WantedKind, ...] = ("alert", "data", "drill")
"""Kinds of messages for an Alertmanager, which keeps open alerts; an earthquake does not stay open."""
PROGRAMS = frozenset({"webhook", "alertmanager"})
"""Kinds of recipients that are programs: what they get is in English."""
VARIABLE = "env:"
"""Before the name of a variable of the environment that holds an address or a secret."""
SECRET = "whsec_"
"""Before the base64 of a key of Standard Webhooks."""
KEY_BYTES = range(24, 65)
"""Permitted lengths of a key of Standard Webhooks."""
MAIL = re.compile(r"[^@\s<>,;:\"]+@[^@\s<>,;:\"]+", re.ASCII)
SERVICE = re.compile(r"[a-z][a-z0-9]*://\S+", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class ReceiverRule:
    """A recipient: name, address and subscriptions."""

    name: str
    kind: ReceiverKind
    address: str = field(repr=False)
    """It may hold a password or a token."""
    secret: str | None = field(repr=False)
    kinds: tuple[WantedKind, ...]
    severities: tuple[Severity, ...]
    report: bool = False
    """True if mails about earthquakes carry the report as PDF."""
    language: Language = ENGLISH
    """In which a person gets messages, and the report."""


def wanted_kinds(kind: ReceiverKind) -> tuple[WantedKind, ...]:
    """Default subscriptions of a kind of recipient."""
    return STANDING if kind == "alertmanager" else WANTED_KINDS


def wrong_address(kind: str, address: str) -> str | None:
    """The error in an address, without repeating it; None if it is valid."""
    if address.startswith(VARIABLE):
        return _wrong_variable(address)
    if kind == "email":
        return None if MAIL.fullmatch(address) else "give one mail address, such as name@example.org"
    if kind == "apprise":
        return None if SERVICE.fullmatch(address) else "give an address of Apprise, such as slack://TOKEN"
    return None if _is_web_address(address) else "give an address such as https://example.org/menshin"


def wrong_secret(kind: str, secret: str | None) -> str | None:
    """The error in a secret, without repeating it; None if it is valid."""
    if kind != "webhook":
        return None if secret is None else "only a webhook is signed; leave it out"
    if secret is None:
        return "a webhook is signed; give whsec_ and the base64 of 24 to 64 random bytes"
    if secret.startswith(VARIABLE):
        return _wrong_variable(secret)
    try:
        key = base64.b64decode(secret.removeprefix(SECRET), validate=True)
    except (binascii.Error, ValueError):
        key = b""
    if not secret.startswith(SECRET) or len(key) not in KEY_BYTES:
        return "must be whsec_ and the base64 of 24 to 64 bytes"
    return None


def wrong_report(kind: str, report: object) -> str | None:
    """The error in the wish for a report; None if it is valid."""
    return "only mail carries a report; leave it out" if report is True and kind != "email" else None


def wrong_language(kind: str, language: object) -> str | None:
    """The error in a known language; None if it is valid."""
    is_other = language not in (None, ENGLISH)
    return "programs get messages in English; leave it out" if is_other and kind in PROGRAMS else None


def shown_address(kind: str, address: str) -> str:
    """An address as it may be shown: of a web address only the server, of a chat service only its name."""
    if kind == "email" or address.startswith(VARIABLE):
        return address
    if kind == "apprise":
        return f"{address.partition('://')[0]}://…"
    parts = urlsplit(address)
    host = f"[{parts.hostname}]" if ":" in (parts.hostname or "") else parts.hostname
    port = "" if parts.port is None else f":{parts.port}"
    return f"{parts.scheme}://{host}{port}/{'…' if parts.path.strip('/') or parts.query else ''}"


def _wrong_variable(value: str) -> str | None:
    name = value.removeprefix(VARIABLE)
    return None if re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name) else "must name a variable, as in env:TOWER_SECRET"


def _is_web_address(address: str) -> bool:
    try:
        parts = urlsplit(address)
        return parts.scheme in ("https", "http") and bool(parts.hostname) and parts.port != 0 and address.isprintable()
    except ValueError:  # a port that is none
        return False
