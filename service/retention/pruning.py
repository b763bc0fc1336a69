"""The rules of retention by kind, the references that keep rows, and the deletion in small steps.

Of a current analysis everything stays. Of one that a later one superseded the histories go, nine tenths of what it
takes, or by a rule of its own all of it. Of an original file the row stays, with day and rule.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

from sqlalchemy import ColumnElement, Text, and_, cast, delete, exists, func, literal, or_, select, update
from sqlalchemy.orm import Session, aliased, sessionmaker

from service.access.tables import AuditEntry
from service.alerts.tables import Alert
from service.analyses.tables import (
    DELETED,
    Analysis,
    CycleResult,
    DirectionResult,
    LayerResult,
    ModeResult,
    SensorResult,
    ShakingResult,
)
from service.db.sessions import reading
from service.drift.tables import MonitoredSeries
from service.jobs.tables import Job
from service.models.tables import ModelComparison, ModelDiagnosis, ModelVersion
from service.notify.tables import Delivery, DeliveryAttempt, Message
from service.records import originals
from service.records.tables import Content, Event, EventRecording, Packet, Recording
from service.retention.references import referring
from service.settings import Settings

REQUIRED = ("force", "force_rigid", "force_modal", "force_std_history")
OPTIONAL = ("displacement", "velocity", "displacement_std_history", "velocity_std_history")
OF_LAYER = ("torsion", "torsion_std_history", "axial_load")
"""Columns of histories: those that each direction has, those that it may have, and those across directions."""
AT_ONCE = 50
"""Rows that one transaction deletes, for which other writers wait: some 10 MB of histories. Not tuned."""
ROW = 500
"""Bytes of a row without large columns, about: what `prune` prints beside the number of rows."""
OVER = ("done", "failed", "cancelled")
DELIVERED = ("delivered", "failed", "dropped")
"""States of jobs, and of deliveries, that have ended."""


@dataclass(frozen=True, slots=True)
class Rule:
    """Rows of one kind that may be deleted once its period is over."""

    kind: str
    setting: str
    """Its period, s."""
    id: ColumnElement[Any]
    size: ColumnElement[int]
    """Bytes of a row."""
    old: Callable[[datetime], ColumnElement[bool]]
    """Rows from before a time that are not deleted yet."""
    keeping: Callable[[Session], Mapping[str, ColumnElement[bool]]]
    """References that keep a row of these, by their words."""
    delete: Callable[[Session, Sequence[Any], datetime], None]

    def age(self, settings: Settings) -> float | None:
        """s after which rows may go; None: they stay."""
        group, _, name = self.setting.partition(".")
        age: float | None = getattr(getattr(settings, group), name)
        return age


@dataclass(frozen=True, slots=True)
class Prunable:
    """Number and size of the rows of one kind that may go, or went."""

    kind: str
    setting: str
    age: float | None
    """s; None: all stay."""
    rows: int
    size: int
    """Bytes."""
    kept: Mapping[str, int]
    """Number of the old ones that stay, by what keeps them; several reasons may keep one."""


def prunable(session: Session, settings: Settings, now: datetime) -> list[Prunable]:
    """Rows that `prune` would delete, by kind; reads only."""
    return [_prunable(session, rule, rule.age(settings), now) for rule in RULES]


def _prunable(session: Session, rule: Rule, age: float | None, now: datetime) -> Prunable:
    if age is None:
        return Prunable(rule.kind, rule.setting, None, 0, 0, {})
    old, reasons = rule.old(now - timedelta(seconds=age)), rule.keeping(session)
    counted = select(func.count(), func.coalesce(func.sum(rule.size), 0))
    rows, size = session.execute(counted.where(old, ~or_(*reasons.values()))).one()
    kept = {why: session.scalar(select(func.count(rule.id)).where(old, reason)) for why, reason in reasons.items()}
    return Prunable(rule.kind, rule.setting, age, rows, int(size), {why: count for why, count in kept.items() if count})


def prune(sessions: sessionmaker[Session], settings: Settings, now: datetime) -> list[Prunable]:
    """Delete what the settings allow to delete; several at a time, so that other processes wait for moments only.

    Raises:
        StoreAwayError: deleted original files are still in the store; the next call deletes them there.
    """
    with reading(sessions)() as session:
        found = prunable(session, settings, now)
    for rule, one in zip(RULES, found, strict=True):
        if one.age is not None and one.rows:
            while _prune_some(sessions, rule, one.age, now):
                pass
    originals.delete_outside(sessions, settings.storage)
    return found


def _prune_some(sessions: sessionmaker[Session], rule: Rule, age: float, now: datetime) -> int:
    """Delete some rows of a kind in one transaction, which finds by itself what still may go; their number."""
    with sessions.begin() as session:
        old, reasons = rule.old(now - timedelta(seconds=age)), rule.keeping(session)
        numbers = session.scalars(select(rule.id).where(old, ~or_(*reasons.values())).limit(AT_ONCE)).all()
        if numbers:
            rule.delete(session, numbers, now)
        return len(numbers)


def _sizes(table: Any, names: Sequence[str]) -> ColumnElement[int]:  # noqa: ANN401  a mapped class
    return sum((func.coalesce(func.length(table.__table__.c[name]), 0) for name in names), start=literal(0))


def _texts(table: Any, *names: str) -> ColumnElement[int]:  # noqa: ANN401
    """Bytes of a row with these columns of JSON."""
    return sum((func.coalesce(func.length(cast(table.__table__.c[one], Text)), 0) for one in names), start=literal(ROW))


def _histories(before: datetime) -> ColumnElement[bool]:
    left = exists().where(DirectionResult.analysis_id == Analysis.id, func.length(DirectionResult.force) > len(DELETED))
    return and_(Analysis.created_at < before, ~Analysis.current, left)


def _size_of_histories() -> ColumnElement[int]:
    of_directions = select(func.sum(_sizes(DirectionResult, (*REQUIRED, *OPTIONAL))))
    of_layer = select(func.sum(_sizes(LayerResult, OF_LAYER)))
    return func.coalesce(
        of_directions.where(DirectionResult.analysis_id == Analysis.id).scalar_subquery(), 0
    ) + func.coalesce(of_layer.where(LayerResult.analysis_id == Analysis.id).scalar_subquery(), 0)


def _keeping_analyses(_: Session) -> Mapping[str, ColumnElement[bool]]:
    return {"a comparison of a model refers to it": exists().where(ModelComparison.analysis_id == Analysis.id)}


def _delete_histories(session: Session, numbers: Sequence[int], _: datetime) -> None:
    directions = dict.fromkeys(REQUIRED, DELETED) | dict.fromkeys(OPTIONAL)
    for table, values in ((DirectionResult, directions), (LayerResult, dict.fromkeys(OF_LAYER))):
        session.execute(
            update(table).where(table.analysis_id.in_(numbers)).values(values),
            execution_options={"synchronize_session": False},
        )


def _superseded(before: datetime) -> ColumnElement[bool]:
    return and_(Analysis.created_at < before, ~Analysis.current)


def _size_of_analyses() -> ColumnElement[int]:
    """Bytes of the histories and of the rows."""
    of_directions = select(func.count() * ROW).where(DirectionResult.analysis_id == Analysis.id)
    own_result = (DirectionResult.id == CycleResult.result_id, DirectionResult.analysis_id == Analysis.id)
    of_cycles = select(func.count(CycleResult.id) * ROW).where(*own_result)
    return _size_of_histories() + of_directions.scalar_subquery() + of_cycles.scalar_subquery() + ROW


def _delete_analyses(session: Session, numbers: Sequence[int], _: datetime) -> None:
    directions = select(DirectionResult.id).where(DirectionResult.analysis_id.in_(numbers))
    for statement in (
        *(delete(table).where(table.result_id.in_(directions)) for table in (ModeResult, CycleResult)),
        *(
            delete(table).where(table.analysis_id.in_(numbers))
            for table in (DirectionResult, LayerResult, SensorResult, ShakingResult)
        ),
        delete(Analysis).where(Analysis.id.in_(numbers)),
    ):
        session.execute(statement, execution_options={"synchronize_session": False})


def _files(before: datetime) -> ColumnElement[bool]:
    of_it = Recording.sha256 == Content.sha256
    return and_(originals.is_there(), exists().where(of_it), ~exists().where(of_it, Recording.received_at >= before))


def _keeping_files(session: Session) -> Mapping[str, ColumnElement[bool]]:
    of_it = Recording.sha256 == Content.sha256
    link = EventRecording.recording_id == Recording.id

    def of_event(condition: ColumnElement[bool]) -> ColumnElement[bool]:
        events = select(Recording.sha256).join(EventRecording, link).join(Event, Event.id == EventRecording.event_id)
        return Content.sha256.in_(events.where(condition, Recording.sha256.is_not(None)))

    unread = or_(Recording.state == "stored", and_(Recording.state == "refused", Recording.failures > 0))
    return {
        "gains of sensors come from it": exists().where(of_it, Recording.kind == "station"),
        "it has not been read, or another version may read it": exists().where(of_it, unread),
        "its earthquake is not analysed yet": of_event(Event.state.in_(("gathering", "queued"))),
        **{why: of_event(condition) for why, condition in referring(session).items()},
    }


def _delete_files(session: Session, digests: Sequence[str], now: datetime) -> None:
    values = {"data": b"", "deleted_at": now, "deleted_by": "retention.original_files"}
    session.execute(
        update(Content).where(Content.sha256.in_(digests)).values(values),
        execution_options={"synchronize_session": False},
    )


def _jobs(before: datetime) -> ColumnElement[bool]:
    return and_(Job.state.in_(OVER), Job.finished_at < before)


def _keeping_jobs(_: Session) -> Mapping[str, ColumnElement[bool]]:
    later = aliased(Job)
    alike = (
        later.kind == Job.kind,
        *(
            getattr(later, name).is_not_distinct_from(getattr(Job, name))
            for name in ("event_id", "model_id", "building_id")
        ),
    )
    current = exists().where(ModelVersion.id == Job.model_id, ModelVersion.state == "current")
    return {
        "an analysis is from it": exists().where(Analysis.job_id == Job.id),
        "a diagnosis is from it": exists().where(ModelDiagnosis.job_id == Job.id),
        "monitored values are from it": exists().where(MonitoredSeries.job_id == Job.id),
        "its model is the current one": current,
        "it is the last of its kind and subject": ~exists().where(*alike, later.id > Job.id),
    }


def _delete_jobs(session: Session, numbers: Sequence[int], _: datetime) -> None:
    session.execute(delete(Job).where(Job.id.in_(numbers)), execution_options={"synchronize_session": False})


def _messages(before: datetime) -> ColumnElement[bool]:
    return Message.created_at < before


def _keeping_messages(session: Session) -> Mapping[str, ColumnElement[bool]]:
    later = aliased(Message)
    of_key = (later.building_id == Message.building_id, later.key == Message.key, later.number > Message.number)
    key = literal("alert/") + cast(Alert.id, Text)
    is_open = exists().where(Alert.building_id == Message.building_id, Alert.closed_at.is_(None), Message.key == key)
    under_way = exists().where(Delivery.message_id == Message.id, Delivery.state.not_in(DELIVERED))
    return {
        "it is the last about its subject": ~exists().where(*of_key),
        "its alert is open": is_open,
        "its delivery has not ended": under_way,
    }


def _delete_messages(session: Session, numbers: Sequence[int], _: datetime) -> None:
    deliveries = select(Delivery.id).where(Delivery.message_id.in_(numbers))
    for statement in (
        delete(DeliveryAttempt).where(DeliveryAttempt.delivery_id.in_(deliveries)),
        delete(Delivery).where(Delivery.message_id.in_(numbers)),
        delete(Message).where(Message.id.in_(numbers)),
    ):
        session.execute(statement, execution_options={"synchronize_session": False})


def _delete_packets(session: Session, numbers: Sequence[int], _: datetime) -> None:
    session.execute(delete(Packet).where(Packet.id.in_(numbers)), execution_options={"synchronize_session": False})


def _delete_entries(session: Session, numbers: Sequence[int], _: datetime) -> None:
    session.execute(
        delete(AuditEntry).where(AuditEntry.id.in_(numbers)), execution_options={"synchronize_session": False}
    )


def _newest(table: Any) -> Callable[[Session], Mapping[str, ColumnElement[bool]]]:  # noqa: ANN401  a mapped class
    """Keeps the newest row alone: SQLite would give its number to another one."""
    newest = select(func.max(aliased(table).id)).scalar_subquery()
    return lambda _: {"it is the newest": table.id == newest}


RULES: Sequence[Rule] = (
    Rule(
        "histories of superseded analyses",
        "retention.superseded_histories",
        Analysis.__table__.c.id,
        _size_of_histories(),
        _histories,
        _keeping_analyses,
        _delete_histories,
    ),
    Rule(
        "jobs and their results",
        "retention.jobs",
        Job.__table__.c.id,
        _texts(Job, "arguments", "result"),
        _jobs,
        _keeping_jobs,
        _delete_jobs,
    ),
    Rule(
        "superseded analyses",
        "retention.superseded_analyses",
        Analysis.__table__.c.id,
        _size_of_analyses(),
        _superseded,
        _keeping_analyses,
        _delete_analyses,
    ),
    Rule(
        "original files",
        "retention.original_files",
        Content.__table__.c.sha256,
        Content.__table__.c.size,
        _files,
        _keeping_files,
        _delete_files,
    ),
    Rule(
        "messages that later ones followed",
        "retention.messages",
        Message.__table__.c.id,
        _texts(Message, "sentences", "facts", "data"),
        _messages,
        _keeping_messages,
        _delete_messages,
    ),
    Rule(
        "packets of live streams",
        "stream.keep",
        Packet.__table__.c.id,
        _sizes(Packet, ("data",)),
        lambda before: Packet.received_at < before,
        _newest(Packet),
        _delete_packets,
    ),
    Rule(
        "entries of the audit trail",
        "retention.audit_trail",
        AuditEntry.__table__.c.id,
        _texts(AuditEntry, "details"),
        lambda before: AuditEntry.at < before,
        _newest(AuditEntry),
        _delete_entries,
    ),
)
"""One for each kind, in the order in which they are deleted: jobs before the analyses that keep them, so that no
deletion frees a row of a later kind, which a dry run has not counted."""
