"""Stored alerts follow the candidates: opened, updated, resolved or withdrawn, never deleted, each change recorded."""

from collections.abc import Sequence
from datetime import datetime
from typing import Any

from sqlalchemy.orm import Session

from service.alerts import queries
from service.alerts.candidates import KINDS, AlertCandidate, Scope
from service.alerts.lifecycle import CLOSED, REPORTED, Decision, OpenAlert, OperatorAction, decide
from service.alerts.tables import Alert, AlertChange


def reconcile(
    session: Session, building_id: int, candidates: Sequence[AlertCandidate], scope: Scope, now: datetime
) -> None:
    """Bring the alerts of a building in line with the candidates; repeating it changes nothing.

    It writes no message: `service.alerts.messages` does that.

    Args:
        session: of the transaction that stores the results behind the candidates and has locked the building.
        building_id: of the building.
        candidates: all of now, at most one per cause; what is missing is no longer the case.
        scope: source of the candidates; alerts of other kinds stay as they are.
        now: aware time.

    Raises:
        ValueError: two candidates of one cause, or a kind outside the scope: a bug.
    """
    _check(candidates, scope)
    stored = {alert.cause: alert for alert in queries.open_alerts(session, building_id, KINDS[scope])}
    open_alerts = [_open_alert(session, alert) for alert in stored.values()]
    for decision in decide(candidates, open_alerts, _operator_actions(session, building_id)):
        _apply(session, building_id, stored.get(decision.cause), decision, now)


def is_reconciled(session: Session, building_id: int, candidates: Sequence[AlertCandidate], scope: Scope) -> bool:
    """True if `reconcile` would change nothing; it reads only."""
    stored = {alert.cause: alert for alert in queries.open_alerts(session, building_id, KINDS[scope])}
    if not stored and not candidates:
        return True
    open_alerts = [_open_alert(session, alert) for alert in stored.values()]
    decisions = decide(candidates, open_alerts, _operator_actions(session, building_id))
    return all(_is_applied(stored.get(one.cause), one) for one in decisions)


def record_acknowledgement(alert: Alert, action: OperatorAction | None) -> None:
    """Store who acknowledged an alert; None removes an acknowledgement that no longer covers it."""
    at, by, note = (None, None, None) if action is None else (action.at, action.by, action.note)
    alert.acknowledged_at, alert.acknowledged_by, alert.acknowledgement = at, by, note


def record_change(alert: Alert, state: str, by: str | None, note: str, now: datetime) -> None:
    """Bring an alert into a state, and record why, by whom and on which evidence."""
    alert.state = state
    if state in REPORTED and alert.activated_at is None:
        alert.activated_at = now
    if state in CLOSED:
        alert.closed_at = now
    alert.changes.append(
        AlertChange(at=now, state=state, by=by, note=note, summary=alert.summary, evidence=dict(alert.evidence))
    )


def _check(candidates: Sequence[AlertCandidate], scope: Scope) -> None:
    causes = [one.cause for one in candidates]
    if len(set(causes)) < len(causes):
        raise ValueError(f"candidates of one cause twice: {sorted(causes)}")
    if foreign := [one.kind for one in candidates if one.kind not in KINDS[scope]]:
        raise ValueError(f"the scope {scope} is about {sorted(KINDS[scope])}, not about {foreign}")


def _open_alert(session: Session, alert: Alert) -> OpenAlert:
    return OpenAlert(
        cause=alert.cause,
        kind=alert.kind,
        was_active=alert.activated_at is not None,
        is_revised=queries.has_newer_results(session, alert),
    )


def _operator_actions(session: Session, building_id: int) -> list[OperatorAction]:
    """Acknowledgements and inspections of the building's alerts, ended ones included."""
    return [
        *(
            OperatorAction(cause, change.at, change.by or "", change.note, ends=False, evidence=change.evidence)
            for cause, change in queries.acknowledgements(session, building_id)
        ),
        *(
            OperatorAction(cause, one.at, one.by, one.note, ends=True, evidence=one.evidence)
            for cause, one in queries.inspections(session, building_id)
        ),
    ]


def _apply(session: Session, building_id: int, alert: Alert | None, decision: Decision, now: datetime) -> None:
    if alert is None:
        if decision.candidate is None:
            return
        alert = Alert(building_id=building_id, cause=decision.cause, opened_at=now)
        session.add(alert)
    if decision.candidate is not None and not (decision.candidate.kind == "data" and _is_applied(alert, decision)):
        for name, value in _values(decision.candidate).items():
            setattr(alert, name, value)
        alert.updated_at = now
        record_acknowledgement(alert, decision.acknowledgement)
    if (alert.state, alert.held_by) != (decision.state, decision.held_by):
        alert.held_by = decision.held_by
        record_change(alert, decision.state, None, decision.note or alert.summary, now)


def _is_applied(alert: Alert | None, decision: Decision) -> bool:
    if alert is None or (alert.state, alert.held_by) != (decision.state, decision.held_by):
        return alert is None and decision.candidate is None
    if decision.candidate is None:
        return True
    acknowledged_at = None if decision.acknowledgement is None else decision.acknowledgement.at
    values = _values(decision.candidate)
    return alert.acknowledged_at == acknowledged_at and all(getattr(alert, name) == values[name] for name in values)


def _values(candidate: AlertCandidate) -> dict[str, Any]:
    """Columns of an alert that follow its candidate."""
    same = ("kind", "began_at", "changed_after", "changed_by", "onset_event_id", "raised_event_id", "summary")
    return {
        **{name: getattr(candidate, name) for name in same},
        "event_ids": list(candidate.event_ids),
        "channels": list(candidate.channels),
        "evidence": dict(candidate.evidence),
        "sentences": list(candidate.sentences),
    }
