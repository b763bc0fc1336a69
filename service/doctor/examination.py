"""The complete examination of an installation."""

from collections.abc import Collection, Iterator
from functools import partial
from pathlib import Path

from sqlalchemy import make_url
from sqlalchemy.orm import Session, sessionmaker

from service.db.problems import shown
from service.db.sessions import reading, sessions
from service.doctor import installation, outside
from service.doctor.findings import Check, Finding, Found, State, examined, wrong
from service.settings import Settings

DATABASE = "database"
FURTHER = (
    *("disk", "storage", "clock", "poller", "worker", "notifier", "api"),
    *("mail", "sources", "keys", "recipients"),
)
"""Names of the checks that need the database."""
REST = Finding("the rest", State.UNKNOWN, "everything else needs the database", "repair the database first")


def examine(settings: Settings, timeout: float, only: Collection[str] = ()) -> tuple[Finding, ...]:
    """The findings about an installation; nothing is changed, and nothing is sent to people.

    Args:
        settings: of the service.
        timeout: s that settings and database have, and then again all other checks together.
        only: names of the checks after those of settings and database; without a name all of them.

    Raises:
        KeyError: there is no check of this name.
    """
    checks: dict[str, Check] = {"settings": partial(installation.of_settings, settings)}
    if not _exists(settings.database_url):
        checks[DATABASE] = partial(_none_yet, settings)
        return (*examined(checks, timeout), REST)
    made = sessions(_impatient(settings.database_url))
    try:
        first = examined(checks | {DATABASE: partial(installation.of_database, settings, made)}, timeout)
        if any(one.state not in (State.GOOD, State.NOTE) for one in first if one.check == DATABASE):
            return (*first, REST)
        further = _checks(settings, reading(made), timeout)
        return (*first, *examined({name: further[name] for name in only} if only else further, timeout))
    finally:
        made.kw["bind"].dispose()


def _exists(url: str) -> bool:
    """False for the file of an SQLite database that does not exist: opening it would make it."""
    address = make_url(url)
    name = address.database or ""
    is_file = address.get_backend_name() == "sqlite" and name not in ("", ":memory:") and not name.startswith("file:")
    return not is_file or Path(name).exists()


def _impatient(url: str) -> str:
    """The address of the database, by which an SQLite file in use is not waited for long."""
    address = make_url(url)
    if address.get_backend_name() == "sqlite" and "timeout" not in address.query:
        address = address.update_query_dict({"timeout": str(installation.LOCKED)})
    return address.render_as_string(hide_password=False)


def _none_yet(settings: Settings) -> Iterator[Found]:
    yield wrong(f"{shown(make_url(settings.database_url))} does not exist yet", "`menshin up` creates it")


def _checks(settings: Settings, made: sessionmaker[Session], timeout: float) -> dict[str, Check]:
    """The checks that need the database, in the order in which one failure may cause the next."""
    patience = 0.6 * timeout  # of one request: the check's own deadline comes later
    return {
        "disk": partial(installation.of_disk, settings, made),
        "storage": partial(installation.of_storage, settings, made),
        "clock": partial(installation.of_clock, settings, made),
        "poller": partial(installation.of_poller, settings, made),
        "worker": partial(installation.of_worker, settings, made),
        "notifier": partial(installation.of_notifier, settings, made),
        "api": partial(installation.of_api, settings, patience),
        "mail": partial(outside.of_mail, settings, made),
        "sources": partial(outside.of_sources, settings, made, patience),
        "keys": partial(outside.of_keys, settings, made),
        "recipients": partial(outside.of_recipients, settings, made),
    }
