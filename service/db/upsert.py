"""Inserts that cope with rows that are there already, for either database."""

from typing import Any

from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from service.db.base import Base


def insert_into(session: Session, table: type[Base]) -> Any:  # noqa: ANN401  each dialect has a class of its own
    """An insert of the session's database, with `on_conflict_do_nothing` and `on_conflict_do_update`."""
    dialect: Any = postgresql if session.get_bind().dialect.name == "postgresql" else sqlite
    return dialect.insert(table)
