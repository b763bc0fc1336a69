"""How are the stored alerts of a building brought to what is found now?"""

from collections.abc import Sequence
from datetime import datetime

from sqlalchemy.orm import Session

from service.alerts import queries
from service.alerts.acts import Act
from service.alerts.candidates import KINDS, Found, Scope
from service.alerts.lifecycle import Standing, Verdict, decide
from service.alerts.tables import Alert
from service.alerts.transitions import change, follow, follow_act
from service.buildings.tables import Building


def reconcile(session: Session, building_id: int, found: Sequence[Found], scope: Scope, now: datetime) -> None:
    """Bring the alerts of a building to what is found now: opened, updated, resolved or withdrawn, never deleted.

    Repeating it changes nothing. Nobody is told by this: `service.alerts.event_messages` does that.

    Args:
        session: of the transaction in which the findings are stored.
        building_id: of the building.
        found: all that is found now, at most one of a cause; what is missing is not so any more.
        scope: who found it; alerts of other kinds stay as they are.
        now: aware time.

    Raises:
        ValueError: two findings of one cause, or a kind that is none of the scope's: a bug of ours.
    """
    check(found, scope)
    session.get_one(Building, building_id, with_for_update=True)  # one open alert of a cause, whoever comes at once
    standing = {alert.cause: alert for alert in queries.open_alerts(session, building_id, KINDS[scope])}
    told = [_standing(session, alert) for alert in standing.values()]
    for verdict in decide(found, told, acts(session, building_id)):
        _apply(session, building_id, standing.get(verdict.cause), verdict, now)


def check(found: Sequence[Found], scope: Scope) -> None:
    """Refuse findings that cannot be told apart or belong to others."""
    causes = [one.cause for one in found]
    if len(set(causes)) < len(causes):
        raise ValueError(f"findings of one cause twice: {sorted(causes)}")
    if strange := [one.kind for one in found if one.kind not in KINDS[scope]]:
        raise ValueError(f"the scope {scope} is about {sorted(KINDS[scope])}, not about {strange}")


def acts(session: Session, building_id: int) -> list[Act]:
    """What people did about the building's alerts, ended ones too."""
    return [
        *(
            Act(cause, change.at, change.by or "", change.note, ends=False, evidence=change.evidence)
            for cause, change in queries.acknowledgements(session, building_id)
        ),
        *(
            Act(cause, inspection.at, inspection.by, inspection.note, ends=True, evidence=inspection.evidence)
            for cause, inspection in queries.inspections(session, building_id)
        ),
    ]


def _standing(session: Session, alert: Alert) -> Standing:
    return Standing(
        cause=alert.cause,
        kind=alert.kind,
        was_active=alert.activated_at is not None,
        is_revised=queries.has_newer_results(session, alert),
    )


def _apply(session: Session, building_id: int, alert: Alert | None, verdict: Verdict, now: datetime) -> None:
    if alert is None:
        if verdict.found is None:
            return
        alert = Alert(building_id=building_id, cause=verdict.cause, opened_at=now)
        session.add(alert)
    if verdict.found is not None:
        follow(alert, verdict.found, now)
        follow_act(alert, verdict.act)
    if (alert.state, alert.held_by) != (verdict.state, verdict.held_by):
        alert.held_by = verdict.held_by
        change(alert, verdict.state, None, verdict.note or alert.summary, now)
