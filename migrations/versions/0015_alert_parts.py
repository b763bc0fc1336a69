"""One alert for all directions of a layer, with its parts, and the events between which a change began."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0015_alert_parts"
down_revision = "0014_alert_words"
branch_labels = None
depends_on = None

OF_THE_LAYER = ("stiffness", "damping", "residual_displacement")
Line = sa.Row[*tuple[Any, ...]]
URGENCY = ("active", "acknowledged", "on_hold", "pending")
"""States of open alerts, the one that asks most of people first."""

ALERT = sa.table(
    "alert",
    sa.column("id", sa.Integer()),
    sa.column("building_id", sa.Integer()),
    sa.column("cause", sa.String()),
    sa.column("state", sa.String()),
    sa.column("summary", sa.Text()),
    sa.column("evidence", sa.JSON()),
    sa.column("held_by", sa.String()),
    sa.column("began_at", sa.DateTime(timezone=True)),
    sa.column("event_ids", sa.JSON()),
    sa.column("closed_at", sa.DateTime(timezone=True)),
)
CHANGE = sa.table(
    "alert_change",
    sa.column("alert_id", sa.Integer()),
    sa.column("at", sa.DateTime(timezone=True)),
    sa.column("state", sa.String()),
    sa.column("by", sa.String()),
    sa.column("note", sa.Text()),
    sa.column("summary", sa.Text()),
    sa.column("evidence", sa.JSON()),
)
EVIDENCE = ("alert", "alert_change", "inspection")
"""Tables that keep what was known of an alert."""


def upgrade() -> None:
    """New columns; alerts of one layer are joined: the most urgent one goes on, and the others end as parts of it."""
    with op.batch_alter_table("alert") as table:
        table.add_column(sa.Column("changed_after", sa.DateTime(timezone=True), nullable=True))
        table.add_column(sa.Column("changed_by", sa.DateTime(timezone=True), nullable=True))
    with op.batch_alter_table("drift_alarm") as table:
        for name in ("after_event_id", "by_event_id"):
            table.add_column(sa.Column(name, sa.Integer(), nullable=True))
            table.create_foreign_key(op.f(f"fk_drift_alarm_{name}_event"), "event", [name], ["id"])
    connection = op.get_bind()
    alerts = [row for row in connection.execute(sa.select(ALERT).order_by(ALERT.c.id)) if _layer(row.cause)]
    every: dict[tuple[int, str], list[Line]] = defaultdict(list)
    for row in alerts:
        if row.closed_at is None:
            every[row.building_id, _layer(row.cause)].append(row)
    parts = {row.id: [_part(row, row.evidence)] for row in alerts}
    for rows in every.values():
        lead = min(rows, key=lambda row: (URGENCY.index(row.state), row.id))
        parts[lead.id] = [_part(row, row.evidence) for row in rows]
        for row in rows:
            if row is not lead:
                _end(connection, row, lead.id)
    for row in alerts:
        _rewrite(connection, row, parts[row.id])
    held = ALERT.update().where(ALERT.c.held_by.is_not(None))
    for quantity in OF_THE_LAYER:  # a twin no longer holds its like
        connection.execute(held.where(ALERT.c.held_by.like(f"{quantity}/%")).values(held_by=None, state="active"))


def downgrade() -> None:
    """Each alert is about the direction that it says first again; those that were joined stay ended."""
    connection = op.get_bind()
    for row in connection.execute(sa.select(ALERT).order_by(ALERT.c.id)).all():
        if parts := (row.evidence or {}).get("parts"):
            cause = f"{row.cause}/{parts[0]['subject']}"
            connection.execute(ALERT.update().where(ALERT.c.id == row.id).values(cause=cause))
    for name in EVIDENCE:
        table = sa.table(name, sa.column("id", sa.Integer()), sa.column("evidence", sa.JSON()))
        for row in connection.execute(sa.select(table)).all():
            kept = {key: value for key, value in (row.evidence or {}).items() if key != "parts"}
            connection.execute(table.update().where(table.c.id == row.id).values(evidence=kept))
    with op.batch_alter_table("drift_alarm") as changed:
        for name in ("after_event_id", "by_event_id"):
            changed.drop_constraint(op.f(f"fk_drift_alarm_{name}_event"), type_="foreignkey")
            changed.drop_column(name)
    with op.batch_alter_table("alert") as changed:
        changed.drop_column("changed_by")
        changed.drop_column("changed_after")


def _layer(cause: str) -> str:
    """Cause of the alert that takes the place of one direction's; empty for every other cause."""
    before, _, _ = cause.rpartition("/")
    return before if before.rpartition("/")[2] in OF_THE_LAYER and before.count("/") <= 1 else ""


def _part(row: Line, evidence: Mapping[str, Any] | None) -> dict[str, Any]:
    """As service.alerting.parts writes it, as far as it is known."""
    known = evidence or {}
    return {
        "subject": row.cause.rpartition("/")[2],
        "state": "active" if row.state not in ("pending", "on_hold") else row.state,
        "held_by": row.held_by if row.state == "on_hold" else None,
        **{name: known.get(name) for name in ("rule", "drift", "low", "high")},
        "began_at": row.began_at.replace(tzinfo=row.began_at.tzinfo or UTC).isoformat(),
        "changed_after": None,
        "changed_by": None,
        "events": list(row.event_ids),
        "summary": row.summary,
    }


def _end(connection: sa.Connection, row: Line, lead: int) -> None:
    now = datetime.now(UTC)
    note = f"It is a part of alert {lead} from now on: the directions of one layer are one alert."
    ended = {"state": "resolved", "closed_at": now, "held_by": None}
    connection.execute(ALERT.update().where(ALERT.c.id == row.id).values(**ended))
    change = {"alert_id": row.id, "at": now, "by": None, "note": note, "state": "resolved"}
    connection.execute(CHANGE.insert().values(**change, summary=row.summary, evidence=row.evidence or {}))


def _rewrite(connection: sa.Connection, row: Line, parts: Sequence[Mapping[str, Any]]) -> None:
    """An alert's new cause, and what was known of it with its parts."""
    values = {"cause": _layer(row.cause), "evidence": {**(row.evidence or {}), "parts": list(parts)}}
    connection.execute(ALERT.update().where(ALERT.c.id == row.id).values(**values))
    for name in EVIDENCE[1:]:
        table = sa.table(
            name, sa.column("id", sa.Integer()), sa.column("alert_id", sa.Integer()), sa.column("evidence", sa.JSON())
        )
        for one in connection.execute(sa.select(table).where(table.c.alert_id == row.id)).all():
            known = {**(one.evidence or {}), "parts": [_part(row, one.evidence)]}
            connection.execute(table.update().where(table.c.id == one.id).values(evidence=known))
