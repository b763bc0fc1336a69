"""The disk that the database is on."""

import shutil
from pathlib import Path

from sqlalchemy.orm import Session


def free_bytes(session: Session) -> int | None:
    """Of the disk that the database's file is on; None of a server, which is not ours to look after."""
    address = session.get_bind().engine.url
    if address.get_backend_name() != "sqlite" or not address.database or address.database == ":memory:":
        return None
    return shutil.disk_usage(Path(address.database).parent).free
