"""Checks of what lies outside: the mail server, the sources of records, keys and recipients."""

import os
import smtplib
import socket
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from functools import partial
from http import HTTPStatus
from urllib.parse import urlsplit

import httpx
from sqlalchemy import func, select
from sqlalchemy.orm import Session, sessionmaker

from service.access import keys
from service.access.roles import Role, soon_in_words
from service.addresses import without_credentials
from service.alerts.tables import Alert
from service.buildings import store as building_store
from service.buildings.description import SourceFile
from service.buildings.tables import Building
from service.db import encryption
from service.doctor.findings import Found, good, note, results_in_time, wrong
from service.notify.channels import mail
from service.notify.tables import Delivery, Receiver
from service.records.sources.problems import REFUSED, refusal, unreachable
from service.records.sources.retried_requests import ServerClock
from service.records.streams.seedlink import PORTS
from service.records.tables import READ, Recording, SourceState
from service.settings import Settings
from service.tls import tls_context

TAKEN = 250
"""Reply code of a mail server that agrees (RFC 5321, section 4.2.3)."""
MOST_PROBED = 20
"""Sources that one examination asks: those that fail first."""
MOST_NAMED = 10
"""Buildings, keys or alerts that one sentence or list names."""
RECENT = timedelta(days=7)
"""Age up to which failed messages are reported."""
SLOW = timedelta(minutes=10)
"""Waiting time of a message from which on something is wrong with its delivery. Not tuned."""


def of_mail(settings: Settings, sessions: sessionmaker[Session]) -> Iterator[Found]:
    """The mail server takes the login and the sender; nothing is sent."""
    if settings.smtp.host is None:
        with sessions() as session:
            query = select(func.count(Receiver.id)).where(Receiver.kind == "email", Receiver.removed_at.is_(None))
            needing = session.scalar(query)
        if needing:
            yield wrong(f"no mail server is set, but {needing} recipients get mail", "set smtp.host")
        else:
            yield good("no mail server is set, and no recipient needs one")
        return
    where = f"the mail server {settings.smtp.host}:{settings.smtp.port}"
    try:
        with mail.connected(settings) as server:
            server.ehlo_or_helo_if_needed()
            code, reply = server.mail(settings.smtp.sender)
            with suppress(smtplib.SMTPException, OSError):
                server.rset()
                server.quit()
    except (smtplib.SMTPException, OSError) as error:
        yield wrong(f"{where}: {mail.reply(error)}", "check smtp.host, port, security, user and password")
        return
    if code == TAKEN:
        yield good(f"{where} accepts mail from {settings.smtp.sender}; nothing was sent")
    else:
        words = reply.decode("utf-8", "replace")
        yield wrong(f"{where} refuses the sender {settings.smtp.sender}: {code} {words}", "correct smtp.sender")


@dataclass(frozen=True, slots=True)
class Watched:
    """A building with its source."""

    code: str
    source: SourceFile
    failing_since: datetime | None
    last_record: datetime | None
    since: datetime
    """Time since which the building has been watched."""


def of_sources(settings: Settings, sessions: sessionmaker[Session], timeout: float) -> Iterator[Found]:
    """The sources answer, and records come; the open alerts about data."""
    with sessions() as session:
        failing = session.scalar(
            select(func.count()).select_from(SourceState).where(SourceState.failing_since.is_not(None))
        )
        count = session.scalar(select(func.count(Building.id)))
        watched, alerts = _watched(session), _data_alerts(session)
    if not count:
        yield wrong("no building is monitored", "`menshin building add FILE` adds one")
        return
    answers = results_in_time({one.code: partial(_answer, one.source, timeout) for one in watched}, timeout)
    for one in watched:
        yield from _of_source(one, answers.get(one.code), settings, timeout)
    asked = f"{len(watched)} of {count} buildings" if len(watched) < count else f"{count} buildings"
    yield good(f"the sources of {asked} were examined")
    if failing:
        yield note(f"{failing} sources have failed at the latest poll", "`menshin status` shows the buildings")
    yield from alerts


def _watched(session: Session) -> tuple[Watched, ...]:
    """Buildings with a source, those first whose source fails, then those that were polled longest ago."""
    last = select(func.max(Recording.end)).where(Recording.building_id == Building.id, READ).scalar_subquery()
    query = (
        select(Building, SourceState.failing_since, last.label("last"))
        .outerjoin(SourceState, SourceState.building_id == Building.id)
        .order_by(SourceState.failing_since.is_(None), SourceState.looked_at, Building.code)
        .limit(MOST_PROBED)
    )
    found = []
    for building, since, end in session.execute(query):
        source = building_store.described(session, building).source
        if source is not None:
            found.append(Watched(building.code, source, since, end, building.created_at))
    return tuple(found)


def _data_alerts(session: Session) -> tuple[Found, ...]:
    query = (
        select(Building.code, Alert.summary)
        .join(Building, Building.id == Alert.building_id)
        .where(Alert.kind == "data", Alert.closed_at.is_(None))
        .order_by(Alert.id.desc())
        .limit(MOST_NAMED)
    )
    return tuple(
        wrong(f"open alert about the data of {code}: {summary.rstrip('.')}", "the alert's page says what to do")
        for code, summary in session.execute(query)
    )


@dataclass(frozen=True, slots=True)
class Answered:
    """The answer of a source."""

    problem: str | None
    helps: str = ""
    ahead: timedelta | None = None
    """Lead of its clock over this machine's."""


def _of_source(one: Watched, answered: Answered | None, settings: Settings, timeout: float) -> Iterator[Found]:
    answered = answered or Answered(f"no answer within {timeout:g} s", REFUSED)
    if answered.problem is not None:
        yield wrong(f"the source of {one.code}: {answered.problem}", answered.helps)
    elif answered.ahead is not None and abs(answered.ahead.total_seconds()) > settings.data_health.clock_tolerance:
        seconds = answered.ahead.total_seconds()
        where = f"{abs(seconds):.0f} s {'ahead of' if seconds > 0 else 'behind'} this machine's"
        yield wrong(f"the clock of the source of {one.code} is {where}", "synchronise both with a time server (NTP)")
    longest = timedelta(
        seconds=settings.data_health.continuous_timeout
        if one.source.data == "continuous"
        else settings.data_health.event_silence_timeout
    )
    if datetime.now(UTC) - max(one.last_record or one.since, one.since) > longest:
        last = "ever" if one.last_record is None else f"since {one.last_record:%Y-%m-%d %H:%M} UTC"
        yield wrong(f"no usable record of {one.code} has come {last}", "check the recorder, and `menshin poll --once`")


def _answer(source: SourceFile, timeout: float) -> Answered:
    """The answer of a source to a question that changes nothing."""
    if source.kind == "folder":
        return _folder(source.location)
    parts = urlsplit(source.location)
    if parts.scheme not in ("http", "https"):
        return _connection(parts.hostname or "", parts.port or PORTS.get(parts.scheme), timeout)
    address = source.location
    if source.kind == "fdsnws":
        address = f"{source.location.split('/fdsnws')[0].rstrip('/')}/fdsnws/dataselect/1/version"
    shown, clock = without_credentials(address), ServerClock(lambda: datetime.now(UTC))
    try:
        with (
            httpx.Client(verify=tls_context(), timeout=timeout, event_hooks={"response": [clock.note]}) as client,
            client.stream("GET", address) as response,
        ):
            status, reason = response.status_code, response.reason_phrase
    except httpx.TimeoutException:
        return Answered(f"no answer within {timeout:g} s", REFUSED)
    except (httpx.HTTPError, httpx.InvalidURL) as error:
        return Answered(*unreachable(shown, error))
    if status >= HTTPStatus.BAD_REQUEST:
        words, _, helps = refusal(status, reason).partition("; ")
        return Answered(f"{shown} {words}", helps)
    return Answered(None, ahead=clock.ahead)


def _folder(location: str) -> Answered:
    try:
        with os.scandir(location) as entries:
            next(entries, None)
    except OSError as error:
        helps = "create the folder or mount it, give this account the right to read it, or correct the building file"
        return Answered(f"the folder {location} cannot be read: {error.strerror}", helps)
    return Answered(None)


def _connection(host: str, port: int | None, timeout: float) -> Answered:
    try:
        socket.create_connection((host, port or 0), timeout=timeout).close()
    except OSError as error:
        return Answered(*unreachable(f"{host}:{port}", error))
    return Answered(None)


def of_keys(settings: Settings, sessions: sessionmaker[Session]) -> Iterator[Found]:
    """An admin can come in, and which keys end soon."""
    now = datetime.now(UTC)
    with sessions() as session:
        valid = [one for one in keys.every(session) if not keys.is_over(one, now)]
    admins = [one.name for one in valid if one.role == Role.admin.name and one.buildings is None]
    signing_in = [one.group for one in settings.oidc.grants if one.role == "admin" and one.buildings is None]
    if admins or signing_in:
        names = [*admins, *(f"the group {group} by sign-in" for group in signing_in)]
        yield good(f"admins of all buildings: {_named(names)}")
    else:
        yield wrong(
            "no key belongs to an admin of all buildings",
            "`menshin key create NAME --role admin` creates one; `menshin login` prints a link for a browser",
        )
    for one in valid:
        if soon := soon_in_words(one.expires_at, now):
            yield note(f"the key {one.name!r} ends {soon}", "make a new key with `menshin key create`, and replace it")


def of_recipients(settings: Settings, sessions: sessionmaker[Session]) -> Iterator[Found]:
    """Every building has recipients, and messages arrive."""
    now = datetime.now(UTC)
    with sessions() as session:
        told = select(Receiver.building_id).where(Receiver.removed_at.is_(None))
        nobody = session.scalars(select(Building.code).where(Building.id.not_in(told)).order_by(Building.code)).all()
        number = session.scalar(select(func.count(Receiver.id)).where(Receiver.removed_at.is_(None)))
        failed = session.scalar(
            select(func.count(Delivery.id)).where(Delivery.state == "failed", Delivery.finished_at > now - RECENT)
        )
        oldest = session.scalar(select(func.min(Delivery.created_at)).where(Delivery.state.in_(("waiting", "sending"))))
        others = session.scalar(
            select(func.count(Receiver.id)).where(Receiver.kind != "email", Receiver.removed_at.is_(None))
        )
    if nobody:
        yield note(
            f"no recipient gets messages about {_named(nobody)}",
            "add [[receiver]] to the building file, or a recipient on the page 'Messages'",
        )
    if failed:
        yield wrong(
            f"the delivery of {failed} messages was given up in the last 7 days", "the page 'Messages' shows why"
        )
    if oldest is not None and now - oldest > SLOW:
        yield wrong(
            f"a message has waited since {oldest:%Y-%m-%d %H:%M} UTC",
            "the page 'Messages' shows the last attempt; see also mail and the notifier",
        )
    if others and not encryption.is_key_set():
        yield note(
            f"addresses and secrets of {others} recipients are stored unencrypted",
            f"set {encryption.VARIABLE} (docs/reference/settings.md)",
        )
    if number:
        yield good(f"{number} recipients; `menshin drill --building CODE` tests the whole way to them")


def _named(names: Sequence[str]) -> str:
    more = len(names) - MOST_NAMED
    return ", ".join(names[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
