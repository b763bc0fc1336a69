"""Contents of a building: the rows of every table, and the numbers that they hold of each other.

A foreign key says by itself what it refers to. Numbers within JSON and text are listed here.
"""

import re
from collections.abc import Callable, Mapping
from typing import Any

from sqlalchemy import ColumnElement, Select, Table, or_, select

import service.db.sessions  # noqa: F401  all tables are known once it is imported
from service.alerts import texts
from service.db.base import Base
from service.notify.outbox import ENDED, digest_of

LEFT_OUT: Mapping[str, str] = {
    "api_key": "keys belong to an installation",
    "login_session": "sessions belong to an installation",
    "login_link": "links for logging in belong to an installation",
    "building_link": "links open the pages of an installation without a key; make new ones",
    "audit_entry": "the audit trail is the installation's own",
    "lease": "leases are held by processes",
    "building_check": "the next round of checks makes it",
    "drift_state": "the next monitoring of drift makes it",
    "kept_effect": "kept effects are those of all buildings; the file of each goes into effects_folder elsewhere",
}
"""Tables of which an export has nothing, and why."""
FILES = "content"
"""Its rows are original files: an export has them as such, by their SHA-256; of deleted ones it has the rows."""
DELETED = ("sha256", "size", "deleted_at", "deleted_by")
"""Columns of these rows."""
PARENTS: Mapping[str, str] = {
    "event_recording": "event_id",
    "waveform": "event_id",
    "alert_change": "alert_id",
    "alert_comment": "alert_id",
    "inspection": "alert_id",
    "delivery": "message_id",
    "delivery_attempt": "delivery_id",
    "analysis": "event_id",
    "direction_result": "analysis_id",
    "layer_result": "analysis_id",
    "sensor_result": "analysis_id",
    "shaking_result": "analysis_id",
    "cycle_result": "result_id",
    "mode_result": "result_id",
    "model_comparison": "model_id",
    "model_diagnosis": "model_id",
    "diagnosis_picture": "diagnosis_id",
    "drift_alarm": "series_id",
    "drift_value": "series_id",
}
"""Column by which a row belongs to a row that belongs to the building, where no column names the building."""
Shifts = Mapping[str, int]
"""Offset to add to the numbers of a table's rows."""
KEYS: Mapping[str, str] = {
    "event": "event",
    "events": "event",
    "hold_out": "event",
    "earthquake": "event",
    "alert": "alert",
    "diagnosis": "model_diagnosis",
    "made": "model_version",
    "upto": "packet",
}
"""Table whose numbers a key of stored JSON holds."""
SUBJECT = re.compile(r"(/?)(event|alert)(s?/)(\d+)", re.ASCII)
"""Subject of a message, such as `event/17`, and its link, such as `/events/17`."""
ALERT = re.compile(re.escape(texts.FACT_ALERT).replace(r"\{id\}", r"(\d+)"), re.ASCII)


def tables() -> list[Table]:
    """The tables of an export, each after those that it refers to."""
    return [one for one in Base.metadata.sorted_tables if one.name not in {*LEFT_OUT, FILES}]


def expected() -> list[Table]:
    """The tables that the file of an export has."""
    return [*tables(), Base.metadata.tables[FILES]]


def belongs(table: Table, building_id: int) -> ColumnElement[bool]:
    """True for rows that belong to a building; what is under way at this installation does not."""
    if table.name == "building":
        return table.c.id == building_id
    if table.name == FILES:
        recording = Base.metadata.tables["recording"]
        return table.c.sha256.in_(_ids(recording, building_id, "sha256"))
    if table.name == "job":
        of_event, of_model = (_referred(table, name, building_id) for name in ("event_id", "model_id"))
        return or_(table.c.building_id == building_id, of_event, of_model)
    if "building_id" in table.c:
        return table.c.building_id == building_id
    within = _referred(table, PARENTS[table.name], building_id)
    return within & table.c.state.in_(ENDED) if table.name == "delivery" else within


def _referred(table: Table, column: str, building_id: int) -> ColumnElement[bool]:
    [key] = table.c[column].foreign_keys
    return table.c[column].in_(_ids(key.column.table, building_id, key.column.name))


def _ids(table: Table, building_id: int, column: str) -> Select[Any]:
    return select(table.c[column]).where(belongs(table, building_id), table.c[column].is_not(None))


def shifted(name: str, row: dict[str, Any], shifts: Shifts) -> dict[str, Any]:
    """A row of a table with its numbers within JSON and text shifted; its key and foreign keys stay."""
    for column, shift in WITHIN.get(name, {}).items():
        row[column] = shift(row[column], shifts)
    if name == "message":
        _shift_facts(row, shifts)
    return row


def _of_table(table: str) -> Callable[[Any, Shifts], Any]:
    """The shift of a number of a table, or of a list of them."""

    def shift(value: Any, shifts: Shifts) -> Any:  # noqa: ANN401  whatever JSON may hold
        if isinstance(value, list):
            return [shift(one, shifts) for one in value]
        return value + shifts.get(table, 0) if type(value) is int else value

    return shift


def _by_keys(value: Any, shifts: Shifts) -> Any:  # noqa: ANN401  whatever JSON may hold
    """JSON with the numbers under all KEYS shifted, at any depth."""
    if isinstance(value, list):
        return [_by_keys(one, shifts) for one in value]
    if not isinstance(value, dict):
        return value
    return {key: _member(key, one, shifts) for key, one in value.items()}


def _member(key: str, value: Any, shifts: Shifts) -> Any:  # noqa: ANN401  whatever JSON may hold
    if key == "alerts" and isinstance(value, list):  # open alerts in the data of a message, and in its verdict
        of_alert = _of_table("alert")
        listed = [one | {"id": of_alert(one["id"], shifts)} if _has_id(one) else one for one in value]
        return [_by_keys(one, shifts) for one in listed]
    is_number = type(value) is int or (isinstance(value, list) and all(type(one) is int for one in value))
    return _of_table(KEYS[key])(value, shifts) if key in KEYS and is_number else _by_keys(value, shifts)


def _has_id(value: object) -> bool:
    return isinstance(value, dict) and "id" in value


def _top_level(value: Any, shifts: Shifts) -> Any:  # noqa: ANN401  whatever JSON may hold
    """A job's result: deeper in it, in a forecast or a sketch, is no number of a row."""
    if not isinstance(value, dict):
        return value
    return {key: _of_table(KEYS[key])(one, shifts) if key in KEYS else one for key, one in value.items()}


def _in_text(value: Any, shifts: Shifts) -> Any:  # noqa: ANN401  a text
    """The subject or the link of a message."""
    if not isinstance(value, str) or (found := SUBJECT.fullmatch(value)) is None:
        return value
    before, table, after, number = found.groups()
    return f"{before}{table}{after}{int(number) + shifts.get(table, 0)}"


def _shift_facts(row: dict[str, Any], shifts: Shifts) -> None:
    """Shift the alerts in a message's facts, and its digest with them, so that what is no news stays none."""
    was = digest_of(row)
    for fact in row["facts"] or ():
        if isinstance(fact, dict) and (found := ALERT.fullmatch(str(fact.get("name")))):
            fact["name"] = texts.FACT_ALERT.format(id=int(found[1]) + shifts.get("alert", 0))
    if row["digest"] == was:
        row["digest"] = digest_of(row)


WITHIN: Mapping[str, Mapping[str, Callable[[Any, Shifts], Any]]] = {
    "alert": {"event_ids": _of_table("event"), "evidence": _by_keys},
    "alert_change": {"evidence": _by_keys},
    "inspection": {"evidence": _by_keys},
    "drift_alarm": {"event_ids": _of_table("event")},
    "job": {"arguments": _by_keys, "result": _top_level},
    "message": {"key": _in_text, "link": _in_text, "data": _by_keys},
    "model_diagnosis": {
        "fitted": _of_table("event"),
        "held_out": _of_table("event"),
        "analyses": _of_table("analysis"),
    },
    "stream_state": {"looked": _of_table("packet"), "cuts": _by_keys},
}
"""Columns of JSON and text with numbers of rows, by table."""
