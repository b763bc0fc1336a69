"""Export of a building: everything it has at one moment, while the service runs."""

import base64
from collections.abc import Callable, Iterator, Mapping
from datetime import datetime
from typing import IO, Any

from sqlalchemy import LargeBinary, Table, func, select
from sqlalchemy.orm import Session

from service.addresses import without_credentials
from service.buildings import description, recipients, store as building_store
from service.buildings.recipient_rules import VARIABLE, ReceiverRule, shown_address
from service.buildings.tables import Revision
from service.db.base import Base
from service.db.migrate import newest
from service.jobs.stages import ReportStep
from service.notify.tables import Receiver
from service.records import originals
from service.records.originals import is_there
from service.settings.groups import Storage
from service.transfer.archive import Manifest, Writer
from service.transfer.contents import DELETED, FILES, belongs, tables
from service.version import VERSION

AT_ONCE = 50
"""Rows that are read at once: a row of histories has a megabyte."""


def export(
    session: Session,
    code: str,
    file: IO[bytes],
    now: datetime,
    report_step: ReportStep,
    *,
    with_secrets: bool,
    settings: Storage,
) -> Manifest:
    """Write a building with everything it has.

    Args:
        session: that reads and has read nothing yet.
        code: of the building.
        file: open for writing.
        now: aware time.
        report_step: called with the progress.
        with_secrets: write passwords and secrets as they are; otherwise without them, as `without_secrets` does.
        settings: of original files.

    Raises:
        BuildingError: there is no such building.
        StoreAwayError, LostFileError: an original file cannot be read, as `originals.read` says.
    """
    if session.get_bind().dialect.name == "postgresql":
        session.connection(execution_options={"isolation_level": "REPEATABLE READ"})  # all tables at one moment
    building = building_store.find(session, code)
    exported, content = tables(), Base.metadata.tables[FILES]
    counts = {
        one.name: session.scalar(select(func.count()).select_from(one).where(belongs(one, building.id))) or 0
        for one in (*exported, content)
    }
    total, done, writer = sum(counts.values()), 0, Writer(file)
    kept = {} if with_secrets else without_secrets(now)

    def counted(name: str, rows: Iterator[dict[str, Any]]) -> Iterator[dict[str, Any]]:
        nonlocal done
        for row in rows:
            yield row
            done += 1
            report_step(name, done, total)

    for table in exported:
        writer.rows(table.name, counted(table.name, _rows(session, table, building.id, kept)))
    of_files = select(content).where(belongs(content, building.id)).order_by(content.c.sha256)
    deleted = session.execute(of_files.with_only_columns(*(content.c[name] for name in DELETED)).where(~is_there()))
    writer.rows(FILES, counted(FILES, map(dict, deleted.mappings().all())))
    for digest in session.scalars(of_files.with_only_columns(content.c.sha256).where(is_there())).all():
        writer.file(digest, originals.read(session, digest, settings))
        done += 1
        report_step(FILES, done, total)
    return writer.finish(
        menshin=VERSION,
        revision=newest(),
        exported_at=now.isoformat(),
        building=building.code,
        name=building.name,
        with_secrets=with_secrets,
    )


def _rows(
    session: Session, table: Table, building_id: int, kept: Mapping[str, Callable[[dict[str, Any]], None]]
) -> Iterator[dict[str, Any]]:
    """The building's rows of a table as JSON, in the order of their key."""
    binary = [one.name for one in table.columns if isinstance(one.type, LargeBinary)]
    question = select(table).where(belongs(table, building_id)).order_by(*table.primary_key.columns)
    for found in session.execute(question, execution_options={"yield_per": AT_ONCE}).mappings():
        row = dict(found)
        for name in binary:
            row[name] = None if row[name] is None else base64.b64encode(row[name]).decode()
        if table.name == "job" and row["state"] == "running":  # by a worker of this installation
            row |= {"state": "waiting", "claimed_until": None}
        if table.name in kept:
            kept[table.name](row)
        yield row


def without_secrets(now: datetime) -> Mapping[str, Callable[[dict[str, Any]], None]]:
    """Functions that take the secrets out of rows, by table.

    Descriptions have the addresses of servers without name and password, and those of recipients as pages show them. A
    recipient whose address or secret is not wholly there is removed from the time of the export on: nothing can be
    sent to it until the building is updated with its complete file, or the recipient is added again.
    """

    def of_revision(row: dict[str, Any]) -> None:
        rules = building_store.parsed(Revision(**row)).receivers
        row["toml"] = without_credentials(recipients.without_secrets(row["toml"], rules))
        row["parsed"] = description.stored(row["toml"])
        left = building_store.parsed(Revision(**row))
        is_left = any(
            one.secret == was.secret for one, was in zip(left.receivers, rules, strict=True) if _is_secret(was)
        )
        if is_left or (left.source and without_credentials(left.source.location) != left.source.location):
            raise building_store.BuildingError(
                f"revision {row['number']} of the description has a secret that is written with escapes, and could not "
                "be left out; export --with-secrets"
            )

    def of_receiver(row: dict[str, Any]) -> None:
        shown = shown_address(row["kind"], row["address"])
        is_secret = _is_secret(Receiver(**row))
        if shown != row["address"] or is_secret:
            row["removed_at"] = row["removed_at"] or now
        row["address"], row["secret"] = shown, None if is_secret else row["secret"]

    return {"revision": of_revision, "receiver": of_receiver}


def _is_secret(receiver: Receiver | ReceiverRule) -> bool:
    """True if it has the key of a signature, not the name of a variable."""
    return receiver.secret is not None and not receiver.secret.startswith(VARIABLE)
