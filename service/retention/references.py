"""Earthquakes that a verdict, an alert, a baseline, a current model or an inspection refers to."""

from collections.abc import Mapping
from typing import Any

from sqlalchemy import ColumnElement, Select, cast, exists, func, or_, select
from sqlalchemy.orm import InstrumentedAttribute, Session, aliased
from sqlalchemy.types import Integer

from service.alerts.tables import Alert, BuildingInspection
from service.drift.tables import DriftAlarm, DriftValue
from service.models.tables import ModelComparison, ModelDiagnosis, ModelVersion
from service.records.tables import Event


def referring(session: Session) -> Mapping[str, ColumnElement[bool]]:
    """References to an event, as conditions on `Event`, by their words."""
    later = aliased(Event)
    after = exists().where(later.building_id == Event.building_id, later.start > Event.start)
    between = aliased(Event)
    nearer = (
        exists()
        .where(
            between.building_id == Event.building_id,
            between.start > Event.start,
            between.start <= BuildingInspection.inspected_at,
        )
        .correlate(Event, BuildingInspection)  # by itself it looks at the next statement outside alone
    )
    inspected = exists().where(
        BuildingInspection.building_id == Event.building_id, BuildingInspection.inspected_at >= Event.start, ~nearer
    )
    of_alert = (
        *(select(column) for column in (Alert.onset_event_id, Alert.raised_event_id)),
        *(select(column) for column in (DriftAlarm.onset_event_id, DriftAlarm.raised_event_id)),
        *(select(column) for column in (DriftAlarm.after_event_id, DriftAlarm.by_event_id)),
        _listed(session, Alert.event_ids),
        _listed(session, DriftAlarm.event_ids),
    )
    current = ModelVersion.state == "current"
    compared = select(ModelComparison.event_id).join(ModelVersion, ModelVersion.id == ModelComparison.model_id)
    models = select(ModelVersion.id).where(current)
    of_model = (
        compared.where(current),
        *(
            _listed(session, column).where(ModelDiagnosis.model_id.in_(models))
            for column in (ModelDiagnosis.fitted, ModelDiagnosis.held_out)
        ),
    )
    return {
        "a verdict refers to its earthquake": ~after,
        "an alert refers to its earthquake": or_(*(_is_in(one) for one in of_alert)),
        "a baseline refers to its earthquake": _is_in(select(DriftValue.event_id).where(DriftValue.is_reference)),
        "a current model refers to its earthquake": or_(*(_is_in(one) for one in of_model)),
        "an inspection refers to its earthquake": inspected,
    }


def _is_in(numbers: Select[Any]) -> ColumnElement[bool]:
    """True for events with one of these numbers; a list with NULL in it would make every other one unknown."""
    number = numbers.subquery().c[0]
    return Event.id.in_(select(number).where(number.is_not(None)))


def _listed(session: Session, column: InstrumentedAttribute[list[int]]) -> Select[Any]:
    """The numbers in a JSON column of lists."""
    value: ColumnElement[Any]
    if session.get_bind().dialect.name == "postgresql":
        value = func.json_array_elements_text(column).column_valued("value", joins_implicitly=True)
    else:
        value = func.json_each(column).table_valued("value", joins_implicitly=True).c.value
    return select(cast(value, Integer)).select_from(column.parent.local_table)
