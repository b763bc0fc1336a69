"""In which state should every alert of a building be, by what is found now and what people did?

A pure function: the same findings and acts give the same open alerts, whatever was found on the way there.
"""

from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

from service.alerts.acts import Act, latest
from service.alerts.candidates import Found
from service.alerts.holding import holder, reason
from service.alerts.parts import alert_cause, joined
from service.alerts.states import ACKNOWLEDGED, ACTIVE, ON_HOLD, PENDING, RESOLVED, WITHDRAWN

NO_LONGER = "It is no longer found."
GONE = "The evidence that was gathering is gone."
REVISED = "Data of its events were revised or came late, and with them it is not found."


@dataclass(frozen=True, slots=True)
class Standing:
    """An open alert, as far as its end is concerned."""

    cause: str
    kind: str
    was_active: bool
    is_revised: bool
    """Whether there are data of its events that were not there when it was found last."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """What an alert of a cause should be."""

    cause: str
    state: str
    found: Found | None
    """None of an alert that ends because it is not found."""
    held_by: str | None = None
    note: str = ""
    """Why it is so, where its finding does not say that."""
    act: Act | None = None
    """By which it is acknowledged."""


def decide(found: Sequence[Found], standing: Sequence[Standing], acts: Sequence[Act]) -> tuple[Verdict, ...]:
    """What every alert should be, of one building and the kinds of one scope; no verdict: as it is.

    Args:
        found: all that is found now, at most one of a cause; those of one layer's directions become one alert.
        standing: the open alerts, at most one of a cause.
        acts: what people did about the building's alerts, ended ones too.
    """
    answered = {one.cause: latest(acts, [one], ends=True) for one in found}
    live = [one for one in found if answered[one.cause] is None]
    before = {one.cause: one for one in standing}
    alerts = _by_alert(live)
    return (
        *(verdict for cause, parts in alerts.items() for verdict in _found(parts, live, before.get(cause), acts)),
        *_inspected([one for one in found if alert_cause(one.cause) not in alerts], before, answered),
        *_not_found(standing, {alert_cause(one.cause) for one in found}),
    )


def _by_alert(found: Sequence[Found]) -> Mapping[str, Sequence[Found]]:
    """By cause of the alert, what is found of it."""
    every: dict[str, list[Found]] = defaultdict(list)
    for one in found:
        every[alert_cause(one.cause)].append(one)
    return every


def _found(
    parts: Sequence[Found], live: Sequence[Found], before: Standing | None, acts: Sequence[Act]
) -> Iterator[Verdict]:
    sure = [part for part in parts if part.is_sure]
    held = {part.cause: by for part in sure if (by := holder(part, live)) is not None}
    whole = joined(parts, held)
    if not sure:
        if before is None or not _stays(before):
            yield Verdict(whole.cause, PENDING, whole)
    elif free := [part for part in sure if part.cause not in held]:
        act = latest(acts, free, ends=False)
        yield Verdict(whole.cause, ACTIVE if act is None else ACKNOWLEDGED, whole, act=act)
    else:
        by = next(iter(held.values()))
        yield Verdict(whole.cause, ON_HOLD, whole, by.cause, reason(by))


def _inspected(
    found: Sequence[Found], before: Mapping[str, Standing], answered: Mapping[str, Act | None]
) -> Iterator[Verdict]:
    """Open alerts of which an earlier inspection has answered all that is found."""
    acts = {alert_cause(one.cause): answered[one.cause] for one in found}
    for cause, act in acts.items():
        if act is not None and cause in before:
            yield Verdict(cause, RESOLVED, None, note=f"The inspection by {act.by} at {act.at:%Y-%m-%d} answers it.")


def _not_found(standing: Sequence[Standing], causes: Collection[str]) -> Iterator[Verdict]:
    for one in standing:
        if one.cause in causes or _stays(one):
            continue
        if not one.was_active:
            yield Verdict(one.cause, WITHDRAWN, None, note=GONE)
        elif one.kind != "data" and one.is_revised:
            yield Verdict(one.cause, WITHDRAWN, None, note=REVISED)
        else:
            yield Verdict(one.cause, RESOLVED, None, note=NO_LONGER)


def _stays(one: Standing) -> bool:
    """Deterioration and an exceeded limit never resolve by themselves: only an inspection or revised data ends them."""
    return one.kind in ("deterioration", "limit") and one.was_active and not one.is_revised
