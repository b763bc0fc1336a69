"""`python -m benchmarks.drift` tells how soon a drift is found and how often one is told that is none.

Random histories of `tests/support/drifting.py`, the odd seeds: `core.drift.rules` was tuned on the even ones.
"""

import sys
from argparse import ArgumentParser
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from types import MappingProxyType

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "support"))  # the generator is the tests'

import altair as alt
import numpy as np
from drifting import Plan, history, other_direction, series, sloping, stepped

from benchmarks.table import Table
from core.arrays import Vector
from core.drift.alarm import Alarm
from core.drift.alarms import alarms
from core.drift.judged import Judged, strengths
from core.drift.monitor import Monitoring, Reference, monitor
from core.drift.rules import SLOW, SUDDEN, rules
from core.drift.together import alarms_together
from core.drift.watched import quantity

TARGET = Path(__file__).resolve().parents[1] / "docs" / "drift.md"
MARKS = ("<!-- {} -->", "<!-- /{} -->")
"""Of a measured part on the page, by its name."""
HEALTHY = 100
"""Events after the reference, in which a healthy building may alarm."""
EARLIEST, LATEST = 40, 100
"""Event with which a change begins."""
REPAIRED = 15
"""Events from a loss until its repair."""
PLANS: Mapping[str, Plan] = MappingProxyType(
    {
        "scatter 1 to 2 %": Plan(),
        "scatter 0.5 %": Plan(scatter=(0.005, 0.005)),
        "scatter 1 %": Plan(scatter=(0.01, 0.01)),
        "scatter 2 %": Plan(scatter=(0.02, 0.02)),
        "1 to 2 %, no thermometer": Plan(has_thermometer=False),
        "1 to 2 %, the giant takes 5 % for a while": Plan(scragging=0.05),
    }
)


SHARED = 0.3
"""Correlation of the scatter of two directions."""
FIRST_REFERENCE = 20
"""Events of nearly every reference."""
TOGETHER = ("scatter 1 to 2 %", "scatter 1 %", "scatter 2 %", "1 to 2 %, no thermometer")
WITHIN: Mapping[str, tuple[str, int]] = MappingProxyType(
    {
        "5 % within 2 events": ("5 %", 2),
        "5 % within 3 events": ("5 %", 3),
        "2 % within 10 events": ("2 %", 10),
        "0.5 % an event within 12 events": ("slow", 12),
    }
)
"""Curves of the pictures: the change, and how many events it may take to be found."""


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """What became of one history: events until something was told, None if it was not."""

    healthy: frozenset[str]
    """Rules that alarmed in a hundred healthy events."""
    found: Mapping[str, int | None]
    """Until a loss was told, by change."""
    repair: int | None
    """Until the repair of an 8 % loss was."""
    is_covered: bool | None
    """Whether the interval of the 5 % loss holds it; None if it was not found as a sudden one."""
    highest: float
    """Strongest evidence of a loss in a hundred healthy events."""
    strongest: Mapping[str, float]
    """The same in the events within which a change is to be found, by WITHIN."""


def trial(plan: Plan, seed: int) -> Trial:
    """One history, healthy and with each change."""
    lived = history(plan, seed)
    healthy = monitor(series(lived), Reference(), {})
    onset = onset_after(seed, healthy)
    lost, mended = stepped(lived, onset, 0.08), stepped(lived, onset + REPAIRED, 0.08)
    changed = {
        "5 %": with_change(healthy, stepped(lived, onset, 0.05)),
        "2 %": with_change(healthy, stepped(lived, onset, 0.02)),
        "slow": with_change(healthy, sloping(lived, onset, 0.005)),
        "8 %": with_change(healthy, lost - mended),
    }
    told = {name: told_of(healthy, one) for name, one in changed.items()}
    last = max(n for n, value in enumerate(healthy.values) if value.is_reference) + HEALTHY
    strength = {name: evidence_of_loss(one) for name, one in changed.items()}
    return Trial(
        healthy=frozenset(one.rule for one in healthy.alarms if one.is_firing and one.raised <= last),
        found={name: events_until(losses(alarms), onset) for name, alarms in told.items()},
        repair=events_until(recoveries(told["8 %"]), onset + REPAIRED),
        is_covered=is_covered(losses(told["5 %"]), onset, -0.05),
        highest=max(
            (value for event, value in evidence_of_loss(judged(healthy)).items() if event <= last), default=0.0
        ),
        strongest={
            label: max((strength[name].get(onset + n, 0.0) for n in range(count)), default=0.0)
            for label, (name, count) in WITHIN.items()
        },
    )


def onset_after(seed: int, *healthy: Monitoring) -> int:
    """At random, but not in a reference."""
    last = max(value.event for one in healthy for value in one.values if value.is_reference)
    return max(last + 1, int(np.random.default_rng([seed, 1]).integers(EARLIEST, LATEST)))


def judged(found: Monitoring) -> Judged:
    if found.judged is None:
        raise ValueError("a history of so many events has a baseline")
    return found.judged


def with_change(healthy: Monitoring, change: Vector) -> Judged:
    """As if the stiffness had changed: all cycles of an event by the same share, and so their mean.

    Args:
        healthy: of a history whose reference ends before the change begins.
        change: (events,) relative.
    """
    whole = judged(healthy)
    if any(change[value.event] for value in healthy.values if value.is_reference):
        raise ValueError("the reference must be healthy")
    shift = np.log1p(change[[one.event for one in whole.dated]])
    return replace(whole, deviation=whole.deviation + shift)


def told_of(healthy: Monitoring, changed: Judged) -> tuple[Alarm, ...]:
    """By the rules over several events."""
    if healthy.baseline is None:
        raise ValueError("a history of so many events has a baseline")
    return alarms(quantity("stiffness"), healthy.baseline, changed)


def losses(alarms: Sequence[Alarm]) -> list[Alarm]:
    return [one for one in alarms if one.is_firing and one.drift < 0]


def recoveries(alarms: Sequence[Alarm]) -> list[Alarm]:
    return [one for one in alarms if one.is_firing and one.drift > 0]


@dataclass(frozen=True, slots=True)
class Together:
    """What the mean of both directions told of one history; events until a loss was told, None if it was not."""

    is_false: bool
    found: Mapping[str, int | None]


def trial_together(plan: Plan, seed: int) -> Together:
    """The same changes in both directions of one building."""
    lived = history(plan, seed)
    one, other = (
        monitor(series(side), Reference(), {}) for side in (lived, other_direction(plan, lived, seed, SHARED))
    )
    onset = onset_after(seed, one, other)
    changes = {
        "5 %": stepped(lived, onset, 0.05),
        "2 %": stepped(lived, onset, 0.02),
        "slow": sloping(lived, onset, 0.005),
    }
    told = {
        name: alarms_together(*(replace(side, judged=with_change(side, change)) for side in (one, other)))
        for name, change in changes.items()
    }
    last = FIRST_REFERENCE + HEALTHY
    return Together(
        any(alarm.is_firing and alarm.raised <= last for alarm in alarms_together(one, other)),
        {name: events_until(losses(alarms), onset) for name, alarms in told.items()},
    )


def events_until(alarms: Sequence[Alarm], onset: int) -> int | None:
    """From the first event with the change, which counts, to the one that raised an alarm."""
    return next((alarm.raised - onset + 1 for alarm in alarms if alarm.raised >= onset), None)


def is_covered(alarms: Sequence[Alarm], onset: int, truth: float) -> bool | None:
    first = next((alarm for alarm in alarms if alarm.raised >= onset), None)
    return None if first is None or first.rule != SUDDEN else first.low <= truth <= first.high


def evidence_of_loss(sequence: Judged) -> Mapping[int, float]:
    """By event, the strongest of the two rules for losses before any alarm is allowed for."""
    white = sequence.innovations()
    wanted = [rule for rule in rules(quantity("stiffness")) if rule.name in (SUDDEN, SLOW)]
    best: Vector = np.max([strengths(white, rule, 0).max(axis=1) for rule in wanted], axis=0)
    return {one.event: float(value) for one, value in zip(sequence.dated, best, strict=True)}


def share(values: Sequence[bool]) -> str:
    """In percent, with its standard error."""
    p, count = float(np.mean(values)), len(values)
    return f"{100 * p:.1f} ± {100 * np.sqrt(max(p * (1 - p), 0.25 / count) / count):.1f}"


def row(name: str, trials: Sequence[Trial]) -> tuple[str, ...]:
    """Of one plan."""

    def within(change: str, events: int) -> str:
        return share([(n := one.found[change]) is not None and n <= events for one in trials])

    covered = [one.is_covered for one in trials if one.is_covered is not None]
    return (
        name,
        share([bool(one.healthy) for one in trials]),
        within("5 %", 2),
        within("5 %", 3),
        within("5 %", 5),
        within("8 %", 2),
        within("2 %", 10),
        within("2 %", 20),
        within("slow", 12),
        share([one.repair is not None and one.repair <= 3 for one in trials]),
        share(covered),
    )


def table_together(every: Mapping[str, Sequence[Together]]) -> Table:
    def within(trials: Sequence[Together], change: str, events: int) -> str:
        return share([(n := one.found[change]) is not None and n <= events for one in trials])

    return Table(
        "Both directions together",
        f"The mean of two directions whose scatter has a correlation of {SHARED}, by the same rules; the same "
        "earthquakes, weather and loss in both.",
        (
            "histories",
            "false alarm",
            "5 % in 2",
            "5 % in 3",
            "5 % in 5",
            "2 % in 10",
            "2 % in 20",
            "0.5 % an event in 12",
        ),
        tuple(
            (
                name,
                share([one.is_false for one in trials]),
                *(within(trials, "5 %", events) for events in (2, 3, 5)),
                *(within(trials, "2 %", events) for events in (10, 20)),
                within(trials, "slow", 12),
            )
            for name, trials in every.items()
        ),
    )


def tables(every: Mapping[str, Sequence[Trial]]) -> Iterator[Table]:
    count = len(next(iter(every.values())))
    yield Table(
        "What is found, and what is told for nothing",
        f"Share of {count} random histories, in percent, with its standard error. The first event with the change "
        "counts as one.",
        (
            "histories",
            "false alarm in 100 healthy events",
            "5 % in 2",
            "5 % in 3",
            "5 % in 5",
            "8 % in 2",
            "2 % in 10",
            "2 % in 20",
            "0.5 % an event in 12",
            "repair of 8 % in 3",
            "interval holds 5 %",
        ),
        tuple(row(name, trials) for name, trials in every.items()),
    )
    yield Table(
        "False alarms by rule",
        "The same histories.",
        ("histories", "sudden", "slow", "recovery", "within an event"),
        tuple(
            (
                name,
                *(share([rule in one.healthy for one in trials]) for rule in ("sudden", "slow", "recovery", "within")),
            )
            for name, trials in every.items()
        ),
    )


def picture(name: str, trials: Sequence[Trial]) -> alt.Chart:
    """Share found over share of false alarms as the threshold falls."""
    highest = np.array([one.highest for one in trials])
    thresholds = np.quantile(highest, 1 - np.arange(1, 41) / 200)
    rows = [
        {
            "false": 100 * float(np.mean(highest >= threshold)),
            "found": 100 * float(np.mean([one.strongest[label] >= threshold for one in trials])),
            "change": label,
        }
        for label in WITHIN
        for threshold in thresholds
    ]
    x = alt.X("false:Q", title="false alarms in 100 healthy events, % of histories").scale(domain=[0, 20])
    y = alt.Y("found:Q", title="found, % of histories").scale(domain=[0, 100])
    line = alt.Chart(alt.Data(values=rows), title=name).mark_line(interpolate="step-after")
    colour = alt.Color("change:N", title=None, sort=None).scale(range=["#1f5fa8", "#7fb2e5", "#d9720f", "#222222"])
    return line.encode(x, y, colour).properties(width=300, height=240)


def pictures(every: Mapping[str, Sequence[Trial]]) -> alt.VConcatChart:
    charts = [picture(name, trials) for name, trials in every.items()]
    rows = [alt.hconcat(*charts[n : n + 2]) for n in range(0, len(charts), 2)]
    whole = alt.vconcat(*rows).configure(font="sans-serif").configure_view(stroke=None)
    return whole.configure_axis(titleFontWeight="normal", gridColor="#e6e8eb").configure_legend(labelLimit=300)


def renewed(page: str, name: str, part: str) -> str:
    """The page with a measured part in place of what it had."""
    begin, end = (mark.format(name) for mark in MARKS)
    before, _, rest = page.partition(begin)
    _, _, after = rest.partition(end)
    return f"{before}{begin}\n{part}\n{end}{after}"


def main() -> None:
    """The tables into docs/drift.md and the pictures beside it, or with `--screen` the tables onto the screen only."""
    parser = ArgumentParser(prog="python -m benchmarks.drift", description=__doc__)
    parser.add_argument("parts", nargs="*", default=["one", "both"], help="one direction, both together")
    parser.add_argument("--histories", type=int, default=200)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--plans", nargs="*", default=list(PLANS), help="some of: " + "; ".join(PLANS))
    parser.add_argument("--even", action="store_true", help="the seeds that thresholds are chosen on")
    parser.add_argument("--screen", action="store_true")
    given = parser.parse_args()
    seeds = range(0 if given.even else 1, 2 * given.histories, 2)
    with ProcessPoolExecutor(given.processes) as executor:
        parts: dict[str, str] = {}
        if "one" in given.parts:
            every = {name: list(executor.map(partial(trial, PLANS[name]), seeds, chunksize=8)) for name in given.plans}
            parts["one"] = "\n".join(table.markdown() for table in tables(every))
            if not given.screen:
                pictures(every).save(str(TARGET.with_suffix(".svg")))
        if "both" in given.parts:
            names = [name for name in given.plans if name in TOGETHER]
            joint = {
                name: list(executor.map(partial(trial_together, PLANS[name]), seeds, chunksize=8)) for name in names
            }
            parts["both"] = table_together(joint).markdown()
    for name, part in parts.items():
        print(part)
        if not given.screen:
            TARGET.write_text(renewed(TARGET.read_text(encoding="utf-8"), name, part), encoding="utf-8")


if __name__ == "__main__":
    main()
