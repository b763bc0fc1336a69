"""An assessment for programs: the same object in the API, CloudEvents and files, SI units."""

from math import isfinite
from typing import Any

from service.verdict import words
from service.verdict.assessment import Assessment, OpenAlert
from service.verdict.checks import Check


def assessment_json(found: Assessment) -> dict[str, Any]:
    """The verdict as JSON values; docs/operate/verdict.md explains each."""
    return {
        "level": found.level.value,
        "headline": words.headline(found),
        "sentences": list(words.sentences(found)),
        "is_provisional": bool(found.provisional),
        "is_beyond_history": found.is_beyond_history,
        "checks": [_check(check) for check in found.checks],
        "open_alerts": [_alert(alert) for alert in found.alerts],
    }


def _check(check: Check) -> dict[str, Any]:
    limits = None if check.limits is None else {str(level): limit for level, limit in check.limits}
    return {
        "name": check.name,
        "direction": check.subject or None,
        "outcome": check.outcome.value,
        "level": check.level.value,
        "unit": check.unit,
        "value": check.value,
        "uncertainty": _finite(check.uncertainty),
        "limit": check.limit,
        "limits": limits,
        "source": None if check.limits is None else check.limits.source,
        "reason": check.reason,
        "remedy": check.remedy,
    }


def _finite(value: float | None) -> float | None:
    """JSON has no infinity."""
    return value if value is not None and isfinite(value) else None


def _alert(alert: OpenAlert) -> dict[str, Any]:
    return {
        "id": alert.id,
        "cause": alert.cause,
        "kind": alert.kind,
        "state": alert.state,
        "summary": alert.summary,
        "level": alert.level.value,
        "rests_here": alert.rests_here,
        "is_later": alert.is_later,
    }
