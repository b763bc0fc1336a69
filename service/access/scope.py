"""Sessions that read and change the rows of some buildings only, as if there were no others.

The limit is part of every statement, so that no query, page or list has to know of it. A row of another building is
not found, which is answered with 404.
"""

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

from sqlalchemy import Alias, Column, ColumnElement, FromClause, Join, Select, Table, event, false, or_, select, true
from sqlalchemy.orm import DeclarativeBase, ORMExecuteState, Session, sessionmaker, with_loader_criteria
from sqlalchemy.sql.base import ExecutableOption

from service.access.auditing import AuditedSession
from service.access.roles import Caller
from service.access.tables import ApiKey, AuditEntry, BuildingLink, LoginLink, LoginSession
from service.alerts.tables import (
    Alert,
    AlertChange,
    AlertComment,
    BuildingCheck,
    BuildingInspection,
    Inspection,
    Silence,
)
from service.analyses.tables import (
    Analysis,
    CycleResult,
    DirectionResult,
    LayerResult,
    ModeResult,
    SensorResult,
    ShakingResult,
)
from service.buildings.tables import Building, Revision
from service.drift.tables import DriftAlarm, DriftState, DriftValue, MonitoredSeries, ReferencePeriod
from service.jobs.tables import Job
from service.models.tables import DiagnosisPicture, KeptEffect, ModelComparison, ModelDiagnosis, ModelVersion
from service.notify.tables import Delivery, DeliveryAttempt, Message, Receiver
from service.records.tables import (
    Content,
    Event,
    EventRecording,
    FetchedFile,
    Packet,
    RecordedChannel,
    Recording,
    SourceState,
    StreamState,
    Waveform,
)
from service.verdict.tables import BuildingLevel

Entity = type[DeclarativeBase]
Columns = Any
"""A mapped class or the columns of its table: both have the columns as attributes, which no type describes."""
Condition = Callable[[Caller, Columns], ColumnElement[bool]]
"""The rows that a caller may see, by the columns of their table."""

LIMIT = "limit"
"""Key of a session's `info`: a function that returns the caller whose buildings it shows."""
OF_BUILDING = (
    Revision,
    SourceState,
    FetchedFile,
    Packet,
    StreamState,
    Recording,
    RecordedChannel,
    Event,
    ModelVersion,
    ReferencePeriod,
    MonitoredSeries,
    DriftState,
    Alert,
    BuildingCheck,
    BuildingInspection,
    BuildingLevel,
    Silence,
    Receiver,
    Message,
    BuildingLink,
)
"""Tables with a `building_id`."""
PARENTS: Mapping[Entity, tuple[str, Entity]] = {
    **dict.fromkeys(OF_BUILDING, ("building_id", Building)),
    EventRecording: ("event_id", Event),
    Waveform: ("event_id", Event),
    Analysis: ("event_id", Event),
    DirectionResult: ("analysis_id", Analysis),
    LayerResult: ("analysis_id", Analysis),
    ShakingResult: ("analysis_id", Analysis),
    SensorResult: ("analysis_id", Analysis),
    ModeResult: ("result_id", DirectionResult),
    CycleResult: ("result_id", DirectionResult),
    ModelComparison: ("model_id", ModelVersion),
    ModelDiagnosis: ("model_id", ModelVersion),
    DiagnosisPicture: ("diagnosis_id", ModelDiagnosis),
    DriftValue: ("series_id", MonitoredSeries),
    DriftAlarm: ("series_id", MonitoredSeries),
    AlertChange: ("alert_id", Alert),
    AlertComment: ("alert_id", Alert),
    Inspection: ("alert_id", Alert),
    Delivery: ("message_id", Message),
    DeliveryAttempt: ("delivery_id", Delivery),
}
"""The column that names a row's parent, and the parent's table."""


def limited(sessions: sessionmaker[Session], caller: Callable[[], Caller]) -> sessionmaker[Session]:
    """The sessions, limited to the buildings of a caller; unchanged for a caller with one role on all buildings.

    Args:
        sessions: that read or write everything.
        caller: called at each statement: what a request needs limits the caller to some buildings, maybe later.
    """
    if (known := caller()).buildings is None and not known.higher:
        return sessions
    settings = dict(sessions.kw)
    info = settings.pop("info", None) or {}
    kind = AuditedSession if issubclass(sessions.class_, AuditedSession) else LimitedSession
    return sessionmaker(class_=kind, info=info | {LIMIT: caller}, **settings)


class LimitedSession(Session):
    """A session that reads the rows of some buildings."""


def _limit(state: ORMExecuteState) -> None:
    """Add the limit to a statement, by its mapped classes and by the tables that it names without their classes."""
    limit: Callable[[], Caller] | None = state.session.info.get(LIMIT)
    if limit is None or not (state.is_select or state.is_update or state.is_delete):
        return
    caller = limit()
    if caller.buildings is None:
        return
    statement: Any = state.statement
    if isinstance(statement, Select):
        own = statement.add_columns()
        own._with_options = ()  # tables of eager loads come later, and are limited as relationships
        sources = [source for one in own.get_final_froms() for source in _sources(one)]
        statement = statement.where(*(_of_source(caller, one) for one in sources))
    state.statement = statement.options(*_options(caller))


event.listen(LimitedSession, "do_orm_execute", _limit)
event.listen(AuditedSession, "do_orm_execute", _limit)


def _sources(source: FromClause) -> list[Table | Alias]:
    """Tables of a FROM clause that stand there by another name or without their mapped class."""
    if isinstance(source, Join):
        return _sources(source.left) + _sources(source.right)
    if isinstance(source, Table) and "parententity" not in source._annotations and source in CONDITIONS:
        return [source]
    if isinstance(source, Alias) and source.element in CONDITIONS:
        return [source]
    return []


def _of_source(caller: Caller, source: Table | Alias) -> ColumnElement[bool]:
    """The limit of such a table; without a row, as an outer join may be, there is nothing to hide."""
    condition = CONDITIONS[source.element if isinstance(source, Alias) else source]
    return or_(next(iter(source.primary_key)).is_(None), condition(caller, source.c))


@lru_cache(maxsize=256)
def _options(caller: Caller) -> tuple[ExecutableOption, ...]:
    """The conditions by mapped class, which SQLAlchemy adds wherever a statement or a relationship reads it."""
    return tuple(with_loader_criteria(entity, CONDITIONS[entity.__table__](caller, entity)) for entity in ENTITIES)


def _rows(entity: Entity, caller: Caller) -> Select[Any]:
    """Numbers of the rows that the caller may see, without mapped classes, which would be limited again."""
    table = entity.__table__
    return select(table.c.id).where(CONDITIONS[table](caller, table.c))


def _child(column: str, parent: Entity) -> Condition:
    def condition(caller: Caller, columns: Columns) -> ColumnElement[bool]:
        own: Column[int] = getattr(columns, column)
        return own.in_(_rows(parent, caller))

    return condition


def _building(caller: Caller, columns: Columns) -> ColumnElement[bool]:
    named: ColumnElement[bool] = columns.code.in_(sorted(caller.buildings or ()))
    return named


def _job(caller: Caller, columns: Columns) -> ColumnElement[bool]:
    subjects = {"event_id": Event, "model_id": ModelVersion, "building_id": Building}
    return or_(*(_child(column, parent)(caller, columns) for column, parent in subjects.items()))


def _content(caller: Caller, columns: Columns) -> ColumnElement[bool]:
    table = Recording.__table__
    received = select(table.c.sha256).where(CONDITIONS[table](caller, table.c), table.c.sha256.is_not(None))
    content: ColumnElement[bool] = columns.sha256.in_(received)
    return content


def _own_changes(caller: Caller, columns: Columns) -> ColumnElement[bool]:
    own: ColumnElement[bool] = columns.by == caller.name
    return own


def _none(_: Caller, __: Columns) -> ColumnElement[bool]:
    return false()


def _every(_: Caller, __: Columns) -> ColumnElement[bool]:
    return true()


ENTITIES: Mapping[Entity, Condition] = {
    Building: _building,
    **{entity: _child(*parent) for entity, parent in PARENTS.items()},
    Job: _job,
    Content: _content,
    AuditEntry: _own_changes,
    KeptEffect: _every,
    **dict.fromkeys((ApiKey, LoginSession, LoginLink), _none),
}
"""Every table but the leases, which name no building. A caller of some buildings sees its own changes in the audit
trail, no keys, and every effect, which models of all buildings may have."""
CONDITIONS: Mapping[FromClause, Condition] = {entity.__table__: condition for entity, condition in ENTITIES.items()}
