"""What follows when an alert is ended: the reference period that later earthquakes are compared with."""

from collections.abc import Mapping
from datetime import datetime
from zoneinfo import ZoneInfo

from sqlalchemy.orm import Session

from core.drift.baseline import FEWEST_EVENTS
from service.alerts.tables import Alert
from service.alerts.words import TITLES, of_time, quantity_of, sensor_of
from service.analyses import history

AS_BEFORE, FROM_NOW, SINCE_IT_BEGAN = "as_before", "from_now", "since_it_began"
"""Choices of a person who ends an alert."""


def reference_from(alert: Alert, choice: str, now: datetime) -> datetime | None:
    """Start of the new reference period; None: none begins.

    Raises:
        KeyError: there is no such choice.
    """
    return {
        AS_BEFORE: None,
        FROM_NOW: now,
        SINCE_IT_BEGAN: alert.changed_by or alert.began_at,  # before that, events may not have shown it
    }[choice]


def consequences(session: Session, alert: Alert, zone: ZoneInfo) -> Mapping[str, str]:
    """By choice, what it means for later alarms; none for alerts that no reference period is about."""
    quantity = quantity_of(alert.cause)
    if quantity is None:
        return {}
    sensor = sensor_of(alert.cause)
    title = TITLES[quantity] if sensor is None else f"{TITLES[quantity]} {sensor}"
    shared = "All directions share it." if sensor is None else "Other sensors keep their reference periods."
    since = alert.changed_by or alert.began_at
    count = history.analysed_since(session, alert.building_id, since)
    missing = max(0, FEWEST_EVENTS - count)
    when = of_time(since.astimezone(zone))
    return {
        AS_BEFORE: "The reference period stays. The same change raises no new alert unless it gets worse.",
        FROM_NOW: f"A new reference period begins with the next earthquake. The {title} then needs at least "
        f"{FEWEST_EVENTS} more earthquakes before it can raise an alarm again. {shared}",
        SINCE_IT_BEGAN: f"A new reference period begins with the earthquake of {when}. {_counted(count)}; the {title} "
        f"needs at least {missing} more before it can raise an alarm again. {shared}",
    }


def _counted(count: int) -> str:
    return "1 earthquake counts already" if count == 1 else f"{count} earthquakes count already"
