"""When are people reminded of what was told and nobody has taken on, and in which words?"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo

from service.alerts.event_facts import AlertFacts
from service.alerts.event_notice import GRAVEST, SEVERITIES
from service.alerts.states import NAMES
from service.alerts.words import of_cause, of_duration, of_time
from service.notify.notice import Notice

KEY = "reminder"
"""Under which a building's reminders follow each other."""
APART = timedelta(days=1)
"""Between two reminders of one building at least."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Untaken:
    """An active alert that people were told of and that has not been acknowledged."""

    facts: AlertFacts
    activated_at: datetime
    told_at: datetime
    """When people were told of it last."""


def is_due(untaken: Sequence[Untaken], last: datetime | None, interval: timedelta, now: datetime) -> bool:
    """Whether people are to be reminded now.

    Args:
        untaken: of a building.
        last: when people were reminded of the building's alerts last; None: never.
        interval: after which they are reminded of an alert.
        now: aware time.
    """
    if last is not None and now - last < APART:
        return False
    return any(now - (one.told_at if last is None else max(one.told_at, last)) >= interval for one in untaken)


def reminder(
    building_id: int, code: str, name: str, zone: ZoneInfo, untaken: Sequence[Untaken], interval: timedelta
) -> Notice:
    """What there is to say of all that nobody has taken on; one at least, the gravest first."""
    first = untaken[0].facts
    more = "" if len(untaken) == 1 else f" (and {len(untaken) - 1} more)"
    kinds = {one.facts.kind for one in untaken}
    return Notice(
        key=KEY,
        building_id=building_id,
        kind="data" if kinds == {"data"} else "alert",
        sequence="repeat",
        severity=min((SEVERITIES.get(one, "warning") for one in kinds), key=GRAVEST.index),
        subject=f"Nobody has taken it on yet: {first.summary}{more}",
        sentences=(
            f"This is a reminder of what was told of {name}, still holds, and nobody has taken on.",
            *(
                f"{one.facts.summary}. It has been active since {of_time(one.activated_at.astimezone(zone))}."
                for one in untaken
            ),
            "To take it on, open its page and acknowledge it with a note on what you do about it; or end it there by "
            "what was found at the building. Who may not do so asks an engineer of the service.",
            f"Until then you are reminded every {of_duration(max(interval, APART))}; a silence holds that back.",
        ),
        facts=tuple(
            (f"Alert {one.facts.id}", f"{of_cause(one.facts.cause)}: {NAMES[one.facts.state]}") for one in untaken
        ),
        link=f"/alerts/{first.id}" if len(untaken) == 1 else f"/buildings/{code}/alerts",
        data={"building": code, "alerts": [_data(one) for one in untaken]},
    )


def _data(one: Untaken) -> dict[str, object]:
    facts = one.facts
    return {
        "id": facts.id,
        "cause": facts.cause,
        "kind": facts.kind,
        "state": facts.state,
        "activated_at": one.activated_at.astimezone(UTC).isoformat(),
        "evidence": dict(facts.evidence),
        "summary": facts.summary,
    }
