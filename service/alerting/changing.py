"""What is written when an alert changes: the alert as it is now, and the change beside all earlier ones."""

from datetime import datetime

from service.alerting.found import Found
from service.alerting.states import ACKNOWLEDGED, CLOSED, STANDING
from service.database import Alert, AlertChange


def opened(building_id: int, found: Found, state: str, inhibited_by: str | None, note: str, now: datetime) -> Alert:
    """A new alert with its first change."""
    alert = Alert(building_id=building_id, cause=found.cause, inhibited_by=inhibited_by, opened_at=now)
    follow(alert, found, now)
    change(alert, state, None, note or found.summary, now)
    return alert


def follow(alert: Alert, found: Found, now: datetime) -> None:
    """Let an alert say what is found now."""
    alert.kind, alert.began_at, alert.updated_at = found.kind, found.began_at, now
    alert.onset_event_id, alert.raised_event_id = found.onset_event_id, found.raised_event_id
    alert.event_ids, alert.channels = list(found.event_ids), list(found.channels)
    alert.evidence, alert.summary, alert.sentences = dict(found.evidence), found.summary, list(found.sentences)


def change(alert: Alert, state: str, by: str | None, note: str, now: datetime) -> None:
    """Bring an alert into a state, and keep why, by whom and on which evidence."""
    alert.state = state
    if state in STANDING and alert.fired_at is None:
        alert.fired_at = now
    if state == ACKNOWLEDGED and by is not None:
        alert.acknowledged_at, alert.acknowledged_by, alert.acknowledgement = now, by, note
    if state in CLOSED:
        alert.closed_at = now
    alert.changes.append(
        AlertChange(at=now, state=state, by=by, note=note, summary=alert.summary, evidence=dict(alert.evidence))
    )
