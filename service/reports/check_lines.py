"""Checks of a verdict as lines of a report, each with a bar of its value beside its limits."""

from collections.abc import Iterator
from dataclasses import dataclass

from core.rounding import plain
from service.language.translation import said
from service.reports.texts import OUTCOMES, PLACES, PLAN, WITHOUT_PLACES, clipped, shown
from service.verdict import texts
from service.verdict.assessment import Assessment
from service.verdict.checks import Check, Level, Outcome

WIDTH, HEIGHT = 100.0, 14.0
"""Units of a bar's picture."""
HEADROOM = 1.15
"""Length of the axis over the highest limit or value."""
LONGEST_TITLE = 120
"""Characters, of which a level's name may be a part."""
TICKS = {Level.WATCH: (0.8, "1.5 1.2"), Level.INSPECT: (1.2, ""), Level.ACT: (2.4, "")}
"""Width and dashes of a limit's mark: they differ without colour."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckLine:
    """One check, for display."""

    title: str
    value: str
    """With its 95 % uncertainty."""
    limits: str
    """All limits: watch / inspect / act."""
    source: str
    outcome: str
    words: str
    """The outcome in words, with the level whose limit is exceeded."""
    symbol: str
    bar: str
    """SVG; empty where there is no value or no limit."""
    settles: str
    """The open question and what settles it; empty where nothing is open."""


@dataclass(frozen=True, slots=True)
class Place:
    """A place to inspect."""

    where: str
    signs: str
    reason: str


def check_lines(assessment: Assessment) -> tuple[CheckLine, ...]:
    """All checks, in the order of the verdict."""
    return tuple(_line(check) for check in assessment.checks)


def places(assessment: Assessment) -> tuple[Place, ...]:
    """Places to inspect, by the limits that are exceeded and the open alerts; the gravest first."""
    return tuple(_places(assessment))


def advice(assessment: Assessment) -> str:
    """Sentence below the places, or instead of them."""
    without = "" if any(True for _ in _places(assessment)) else WITHOUT_PLACES.get(assessment.level, "")
    return " ".join(said(part) for part in (without, PLAN) if part)


def _line(check: Check) -> CheckLine:
    is_open = check.outcome is Outcome.UNDECIDED
    exceeded = texts.level_of_limit(check) or check.level
    return CheckLine(
        title=shown(texts.title(check), LONGEST_TITLE),
        value=said(texts.value(check) or ("not known" if is_open else "–")),
        limits=_limits(check),
        source=shown(texts.source(check)),
        outcome=check.outcome.value,
        words=said(f"exceeded: {exceeded.words}") if check.outcome is Outcome.EXCEEDED else texts.outcome(check),
        symbol=OUTCOMES[check.outcome],
        bar=_bar(check),
        settles=clipped(" ".join(said(part) for part in (check.reason, check.remedy) if part)),
    )


def _limits(check: Check) -> str:
    if check.limits is None or not any(True for _ in check.limits):
        return "–"
    unit, factor = texts.shown_unit(check)
    levels = (check.limits.watch, check.limits.inspect, check.limits.act)
    numbers = " / ".join("–" if one is None else plain(one * factor) for one in levels)
    return f"{numbers} {unit}".rstrip()


def _places(assessment: Assessment) -> Iterator[Place]:
    seen = set()
    for check in sorted(assessment.checks, key=lambda one: -one.level.rank):
        if check.level.rank < Level.INSPECT.rank or check.name not in PLACES:
            continue
        where, signs = PLACES[check.name]
        place = clipped(" ".join(said(part) for part in (where, _at(check)) if part))
        if place not in seen:
            seen.add(place)
            yield Place(place, said(signs), shown(f"{texts.within(texts.TITLES[check.name])}: {check.level.words}"))
    for alert in assessment.alerts:
        if alert.level.rank >= Level.INSPECT.rank:
            state = said(texts.STATE_NAMES.get(alert.state, alert.state))
            yield Place(said(f"Alert {alert.id}"), shown(alert.summary), state)


def _at(check: Check) -> str:
    """Level or direction that the check names; notes end with the direction or how the value is known."""
    if check.subject:
        return f"in direction {check.subject}"
    return check.note if PLACES[check.name][0] in ("Storey", "Floor") else ""


def _bar(check: Check) -> str:
    """SVG of the value with its uncertainty, and of the limits; numbers only."""
    if check.value is None or check.limits is None:
        return ""
    limits, size = list(check.limits), abs(check.value)
    u = abs(check.uncertainty or 0.0)
    full = HEADROOM * max([size, *(limit for _, limit in limits)], default=0.0)
    if not limits or not full > 0:
        return ""

    def at(quantity: float) -> float:
        return min(max(WIDTH * quantity / full, 0.0), WIDTH)

    ends = at(size - u), at(size + u)
    marks = "".join(_mark(at(limit), *TICKS[level]) for level, limit in limits)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:g} {HEIGHT:g}">'
        f'<rect x="0" y="4" width="{WIDTH:g}" height="6" fill="#ececec"/>'
        f'<rect x="0" y="4" width="{at(size):.2f}" height="6" fill="#9aa3ad"/>'
        f'<path d="M{ends[0]:.2f} 7H{ends[1]:.2f}M{ends[0]:.2f} 5V9M{ends[1]:.2f} 5V9" stroke="#000" stroke-width="1"/>'
        f"{marks}</svg>"
    )


def _mark(x: float, width: float, dashes: str) -> str:
    dashed = f' stroke-dasharray="{dashes}"' if dashes else ""
    return f'<path d="M{x:.2f} 0V14" stroke="#000" stroke-width="{width:g}"{dashed}/>'
