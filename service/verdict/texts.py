"""The texts of the verdict: the one place for everything that messages, pages and terminals say about it."""

from collections.abc import Iterator, Mapping

from core.rounding import plain, significant, with_std
from service.language.translation import said
from service.verdict.assessment import CLOCKS, DATA, LARGEST, SENSORS, Assessment, Result
from service.verdict.checks import NO_UNCERTAINTY, WITHIN_UNCERTAINTY, Check, Level, Outcome
from service.verdict.limits import (
    DESIGN,
    DRIFT,
    FLOOR_ACCELERATION,
    INTENSITY,
    LONG_PERIOD,
    MOAT,
    RESIDUAL_OFFSET,
    REST_POSITION,
    STIFFNESS_CHANGE,
    STRAIN,
    STROKE,
    TRAVEL,
)

TITLES: Mapping[str, str] = {
    STRAIN: "Shear strain of the isolators",
    DESIGN: "Displacement as a share of the design displacement",
    MOAT: "Displacement as a share of the moat clearance",
    STROKE: "Displacement as a share of the dampers' stroke",
    TRAVEL: "Cumulative travel of the dampers",
    RESIDUAL_OFFSET: "Residual displacement",
    REST_POSITION: "Rest position",
    DRIFT: "Storey drift over height",
    FLOOR_ACCELERATION: "Floor acceleration",
    INTENSITY: "JMA instrumental intensity",
    LONG_PERIOD: "Long-period motion",
    LARGEST: "Displacement against earlier earthquakes",
    STIFFNESS_CHANGE: "Change of stiffness",
    DATA: "Data quality",
    SENSORS: "Health of the sensors",
    CLOCKS: "Health of the clocks",
}
MEANINGS: Mapping[Level, str] = {
    Level.ACT: "An action limit is exceeded. Follow the emergency plan and call the engineer.",
    Level.INSPECT: "Have the building inspected before normal use.",
    Level.NO_DATA: "Menshin has no usable record.",
    Level.UNDECIDED: "Menshin cannot decide whether the building is within its limits and unchanged.",
    Level.WATCH: "No inspection limit is exceeded, but something has changed. Inform the engineer.",
    Level.NORMAL: "This does not replace an inspection.",
}
WATCHED: Mapping[tuple[bool, bool], str] = {
    (True, True): "No inspection limit is exceeded, but a watch limit is, and an alert is open. Inform the engineer.",
    (True, False): "No inspection limit is exceeded, but a watch limit is. Inform the engineer.",
    (False, True): "No inspection limit is exceeded, but an alert is open. Inform the engineer.",
    (False, False): MEANINGS[Level.WATCH],
}
"""Meaning of the level `watch`, by whether a limit is exceeded and whether an alert is open."""
RESULTS: Mapping[str, str] = {
    "fit": "fit for normal use",
    "restricted": "restricted use",
    "unfit": "not for use",
}
"""Results of inspections as people read them."""
INSPECTED_MEANINGS: Mapping[str, str] = {
    "fit": "A limit was exceeded. A later inspection declared the building fit for normal use. Keep it under "
    "observation.",
    "restricted": "Use the building within the restrictions of the inspection.",
    "unfit": "Do not use the building: that is the result of its inspection. Follow the emergency plan.",
}
"""Meaning of a level that follows from an inspection, by its result; of `fit` where a limit was exceeded."""
STATE_NAMES: Mapping[str, str] = {
    "active": "active",
    "acknowledged": "acknowledged",
    "pending": "under review",
    "on_hold": "on hold",
    "resolved": "resolved",
    "withdrawn": "withdrawn",
}
"""States of alerts as people read them."""
SHOWN: Mapping[str, tuple[str, float]] = {
    "1": ("%", 1e2),
    "m": ("mm", 1e3),
    "m/s": ("cm/s", 1e2),
    "m/s²": ("gal", 1e2),
    INTENSITY: ("", 1.0),
    TRAVEL: ("m", 1.0),
}
"""Unit and factor by SI unit, or by check."""
SHARES: Mapping[str, str] = {
    DESIGN: "of the design limit",
    MOAT: "of the gap to the surrounding wall",
    STRAIN: "shear strain",
}
"""Words after the share of a limit, by check, the first that is known first."""
NONE_YET = "No earthquake has been recorded yet."
NOT_ASSESSED = "The isolators cannot be assessed; inspect them if the shaking was strong."
"""Consequence of an earthquake whose records cannot be used."""


def title(check: Check) -> str:
    """`Change of stiffness, direction x`."""
    name = TITLES.get(check.name, check.name.replace("_", " "))
    if check.subject and check.note:
        return f"{name}, direction {check.subject} ({check.note})"
    if check.subject:
        return f"{name}, direction {check.subject}"
    return f"{name} ({check.note})" if check.note else name


def value(check: Check) -> str:
    """`147.6 ± 0.3 %`, with the 95 % uncertainty; empty where there is no value."""
    if check.value is None:
        return ""
    unit, factor = shown_unit(check)
    u = check.uncertainty
    return with_std(check.value * factor, None if u is None else abs(u) * factor, unit)


def brief(check: Check) -> str:
    """`148 %`: the value alone, to three digits; empty where there is none."""
    if check.value is None:
        return ""
    unit, factor = shown_unit(check)
    return f"{significant(check.value * factor)} {unit}".rstrip()


def limit(check: Check) -> str:
    """`67 % (inspect)`: the limit that decides; empty where there is none."""
    if check.limit is None or check.limits is None:
        return ""
    unit, factor = shown_unit(check)
    level = level_of_limit(check)
    return f"{plain(check.limit * factor)} {unit}".rstrip() + (f" ({level.words})" if level else "")


def level_of_limit(check: Check) -> Level | None:
    """The level of the limit that decides: an unclear graver limit may make the level of the check itself graver."""
    if check.limits is None:
        return None
    return next((level for level, one in check.limits if one == check.limit), None)


def of_limit(check: Check) -> str:
    """`Residual displacement: 34 ± 2 mm, limit 30 mm (inspect), Menshin's default`."""
    return ", ".join(
        part for part in (f"{title(check)}: {value(check)}", f"limit {limit(check)}", source(check)) if part
    )


def headline(verdict: Assessment) -> str:
    """One line without an end: the verdict, its first reason, and how many alerts are open."""
    reason = next(_reasons(verdict), "")
    open_alerts = "" if not verdict.alerts else f"{len(verdict.alerts)} alert{'s' * (len(verdict.alerts) > 1)} open"
    return ": ".join(
        part for part in (verdict.level.words, "; ".join(one for one in (reason, open_alerts) if one)) if part
    )


def reason(verdict: Assessment) -> str:
    """The first reason of the level, as a sentence without its full stop; empty where there is none."""
    first = next(_reasons(verdict), "")
    return f"{first[:1].upper()}{first[1:]}"


def moved(verdict: Assessment) -> str:
    """`212 mm, 71 % of the design limit`: the largest displacement, and its share of the limit; empty if unknown."""
    sizes = {check.name: check for check in verdict.checks}
    largest = sizes.get(LARGEST)
    if largest is None or largest.value is None:
        return ""
    share = next((sizes[name] for name in SHARES if name in sizes and sizes[name].value is not None), None)
    doubts = {check.reason for check in sizes.values() if check.name in SHARES and check.limits is not None}
    size = brief(largest) if share is None else f"{brief(largest)}, {brief(share)} {SHARES[share.name]}"
    return f"at least {size}" if doubts - {"", NO_UNCERTAINTY, WITHIN_UNCERTAINTY} else size


def meaning(verdict: Assessment) -> str:
    """Meaning of the level and the action it asks for; after an inspection that decides it, by its result."""
    if verdict.inspection is not None and _comes_first(verdict):
        return INSPECTED_MEANINGS[verdict.inspection.result.value]
    if verdict.level is Level.WATCH:
        return WATCHED[bool(verdict.of_outcome(Outcome.EXCEEDED)), bool(verdict.alerts)]
    return MEANINGS[verdict.level]


def inspected(verdict: Assessment) -> str:
    """The latest inspection, and the automatic result beside it, as sentences; empty without one."""
    one = verdict.inspection
    if one is None:
        return ""
    signed = f"Inspected by {one.by} on {one.at:%Y-%m-%d %H:%M} UTC: {RESULTS[one.result.value]}."
    then = f"The automatic result was {one.level.words} then, and is {verdict.automatic.words} now."
    if one.covers:
        return f"{signed} {then}"
    return f"{signed} {then} The inspection was before the last earthquake, and does not cover it."


def sentences(verdict: Assessment) -> Iterator[str]:
    """The verdict in full, the gravest first, with everything that weakens it."""
    level, *rest = opening(verdict)
    yield level
    for check in verdict.of_outcome(Outcome.EXCEEDED):
        yield " ".join(part for part in (f"{of_limit(check)}.", check.reason, check.remedy) if part)
    yield from rest
    for check in verdict.of_outcome(Outcome.UNDECIDED):
        yield " ".join(part for part in (f"Undecided: {title(check)}.", check.reason, check.remedy) if part)


def opening(verdict: Assessment) -> Iterator[str]:
    """The verdict without its checks."""
    yield f"{verdict.level.words.capitalize()}. {meaning(verdict)}"
    if verdict.inspection is not None:
        yield inspected(verdict)
    if verdict.unusable:
        unusable = verdict.unusable.rstrip(".")
        yield f"{unusable}. {NOT_ASSESSED}"
    if verdict.silence:
        yield f"Later earthquakes may have been missed: {verdict.silence.rstrip('.')}."
    if verdict.provisional:
        yield f"Provisional: {verdict.provisional.rstrip('.')}."
    if verdict.unseen:
        yield f"{verdict.unseen}. Only an inspection can show the effect; record one on the building's page."
    if verdict.checks:
        yield f"{len(verdict.of_outcome(Outcome.PASSED))} of {len(verdict.checks)} checks passed."


def outcome(check: Check) -> str:
    """`passed`, `exceeded` or `undecided`, in the language of what is being shown: its word for a level is another."""
    if check.outcome is Outcome.UNDECIDED:
        return said("undecided check").removesuffix(" check")
    return said(check.outcome.value)


def source(check: Check) -> str:
    """Source of the limits; empty if there are none."""
    return "" if check.limits is None else check.limits.source


def shown_unit(check: Check) -> tuple[str, float]:
    """Unit in which a check is shown, and its number per SI unit."""
    return SHOWN.get(check.name, SHOWN.get(check.unit, (check.unit, 1.0)))


def _decides(verdict: Assessment) -> bool:
    """True if the inspection decides the level: that is not the automatic one, or the inspection restricts the use."""
    one = verdict.inspection
    if one is None:
        return False
    return verdict.level is not verdict.automatic or (one.result is not Result.FIT and verdict.level is one.least)


def _comes_first(verdict: Assessment) -> bool:
    """True if the inspection decides the level and says more than it: not "fit" beside what is undecided or missing."""
    one = verdict.inspection
    if one is None or not _decides(verdict):
        return False
    has_exceeded = bool(verdict.of_outcome(Outcome.EXCEEDED))
    return one.result is not Result.FIT or (verdict.level is Level.WATCH and has_exceeded)


def within(text: str) -> str:
    """A title inside a sentence: its first letter is small, unless it begins with an abbreviation."""
    return text if text[1:2].isupper() else text[:1].lower() + text[1:]


def _reasons(verdict: Assessment) -> Iterator[str]:
    """Reasons of the level, the gravest first."""
    one = verdict.inspection
    by_inspection = ""
    if one is not None and _decides(verdict):
        by_inspection = f"{RESULTS[one.result.value]} by inspection, automatic result {verdict.automatic.words}"
    if by_inspection and _comes_first(verdict):
        yield by_inspection
    worst = [check for check in verdict.checks if check.level is verdict.level and verdict.level is not Level.NORMAL]
    exceeded = [check for check in worst if check.outcome is Outcome.EXCEEDED]
    if exceeded and verdict.level is not Level.UNDECIDED:
        yield _and_more(f"{within(title(exceeded[0]))} {brief(exceeded[0])}", len(exceeded))
    if verdict.level is Level.NO_DATA:
        yield (verdict.unusable or verdict.silence).rstrip(".")
    if verdict.level is Level.UNDECIDED:
        unclear = len(verdict.of_outcome(Outcome.UNDECIDED))
        if unclear:
            yield f"{unclear} of {len(verdict.checks)} checks undecided"
    if alerts := [one for one in verdict.alerts if one.level is verdict.level]:
        yield _and_more(alerts[0].summary, len(alerts))
    if verdict.provisional:
        yield "provisional"
    if verdict.unseen:
        yield verdict.unseen[:1].lower() + verdict.unseen[1:]
    if worst:
        yield f"{within(title(worst[0]))} undecided"
    if verdict.level is Level.NORMAL:
        yield f"{len(verdict.checks)} of {len(verdict.checks)} checks passed"
    if by_inspection and not _comes_first(verdict):
        yield by_inspection


def _and_more(first: str, count: int) -> str:
    """The first of so many."""
    return f"{first} and {count - 1} more" if count > 1 else first
