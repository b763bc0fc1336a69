"""In which state should every alert of a building be, by what is found now and what people did?

A pure function: the same findings and acts give the same open alerts, whatever was found on the way there.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from service.alerting.acts import Act, latest
from service.alerting.found import Found
from service.alerting.holding import holder
from service.alerting.states import ACKNOWLEDGED, ACTIVE, ON_HOLD, PENDING, RESOLVED, WITHDRAWN

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
        found: all that is found now, at most one of a cause.
        standing: the open alerts, at most one of a cause.
        acts: what people did about the building's alerts, ended ones too.
    """
    answered = {one.cause: latest(acts, one, ends=True) for one in found}
    live = [one for one in found if answered[one.cause] is None]
    before = {one.cause: one for one in standing}
    return (
        *(verdict for one in live for verdict in _found(one, live, before.get(one.cause), acts)),
        *_inspected([one for one in found if one.cause in before], answered),
        *_not_found(standing, {one.cause for one in found}),
    )


def _found(one: Found, live: Sequence[Found], before: Standing | None, acts: Sequence[Act]) -> Iterator[Verdict]:
    if not one.is_sure:
        if before is None or not _stays(before):
            yield Verdict(one.cause, PENDING, one)
    elif (by := holder(one, live)) is not None:
        yield Verdict(one.cause, ON_HOLD, one, by.cause, f"Held back by {by.cause}: {by.summary}.")
    else:
        act = latest(acts, one, ends=False)
        yield Verdict(one.cause, ACTIVE if act is None else ACKNOWLEDGED, one, act=act)


def _inspected(found: Sequence[Found], answered: dict[str, Act | None]) -> Iterator[Verdict]:
    """Open alerts whose finding, as it is now, an earlier inspection has answered."""
    for one in found:
        if (act := answered[one.cause]) is not None:
            yield Verdict(
                one.cause, RESOLVED, None, note=f"The inspection by {act.by} at {act.at:%Y-%m-%d} answers it."
            )


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
    """Deterioration never resolves by itself: only an inspection ends it, or data that show that it never was."""
    return one.kind == "deterioration" and one.was_active and not one.is_revised
