"""Files of exported buildings, as tests read and edit them."""

import json
import zipfile
from collections.abc import Callable
from hashlib import sha256
from io import BytesIO
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session, sessionmaker

from service.db.base import Base
from service.transfer.archive import MANIFEST


def entries(data: bytes) -> dict[str, bytes]:
    """The members of an export by name."""
    with zipfile.ZipFile(BytesIO(data)) as found:
        return {name: found.read(name) for name in found.namelist()}


Edit = Callable[[dict[str, Any]], None]


def edited(data: bytes, edit: Edit) -> bytes:
    """An export whose members were edited: the tables as lists of rows, the others as they are; digests fit again."""
    members: dict[str, Any] = dict(entries(data))
    tables = [name for name in members if name.startswith("tables/")]
    for name in tables:
        members[name] = [json.loads(line) for line in members[name].splitlines()]
    members[MANIFEST] = json.loads(members[MANIFEST])
    edit(members)
    for name in tables:
        if name in members:
            members[name] = b"".join(json.dumps(row).encode() + b"\n" for row in members[name])
            if said := members[MANIFEST]["tables"].get(name.removeprefix("tables/").removesuffix(".jsonl")):
                said["sha256"] = sha256(members[name]).hexdigest()
    members[MANIFEST] = json.dumps(members[MANIFEST]).encode()
    file = BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as made:
        for name, member in members.items():
            made.writestr(name, member)
    return file.getvalue()


def put(member: str, key: str, value: object) -> Edit:
    """Set a value in the manifest, or in the last row of a table."""

    def edit(members: dict[str, Any]) -> None:
        (members[member] if member == MANIFEST else members[member][-1])[key] = value

    return edit


def add(name: str, data: bytes) -> Edit:
    """Add a member."""
    return lambda members: members.update({name: data})


def number_of_rows(sessions: sessionmaker[Session]) -> int:
    with sessions() as session:
        return sum(session.scalar(select(func.count()).select_from(one)) or 0 for one in Base.metadata.sorted_tables)
