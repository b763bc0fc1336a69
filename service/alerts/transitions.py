"""What is written when an alert changes: the alert as it is now, and the change beside all earlier ones."""

from datetime import datetime

from service.alerts.acts import Act
from service.alerts.candidates import Found
from service.alerts.states import CLOSED, STANDING
from service.alerts.tables import Alert, AlertChange


def follow(alert: Alert, found: Found, now: datetime) -> None:
    """Let an alert say what is found now."""
    alert.kind, alert.began_at, alert.updated_at = found.kind, found.began_at, now
    alert.changed_after, alert.changed_by = found.changed_after, found.changed_by
    alert.onset_event_id, alert.raised_event_id = found.onset_event_id, found.raised_event_id
    alert.event_ids, alert.channels = list(found.event_ids), list(found.channels)
    alert.evidence, alert.summary, alert.sentences = dict(found.evidence), found.summary, list(found.sentences)


def follow_act(alert: Alert, act: Act | None) -> None:
    """Let an alert say who acknowledged it; nobody, where what somebody acknowledged was another thing, or less."""
    at, by, note = (None, None, None) if act is None else (act.at, act.by, act.note)
    alert.acknowledged_at, alert.acknowledged_by, alert.acknowledgement = at, by, note


def change(alert: Alert, state: str, by: str | None, note: str, now: datetime) -> None:
    """Bring an alert into a state, and keep why, by whom and on which evidence."""
    alert.state = state
    if state in STANDING and alert.activated_at is None:
        alert.activated_at = now
    if state in CLOSED:
        alert.closed_at = now
    alert.changes.append(
        AlertChange(at=now, state=state, by=by, note=note, summary=alert.summary, evidence=dict(alert.evidence))
    )
