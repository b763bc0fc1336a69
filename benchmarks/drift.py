"""`python -m benchmarks.drift` measures how soon a drift is found, and how often there is a false alarm.

Random histories of `tests/support/drift_histories.py`, the odd seeds: `core.drift.rules` was tuned on the even ones.
"""

from argparse import ArgumentParser
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from types import MappingProxyType

import altair as alt
import numpy as np

from benchmarks.drift_trial import SHARED, WITHIN, Dating, PooledTrial, Trial, trial, trial_of_dating, trial_pooled  # isort: skip  (finds the next)
from drift_histories import Plan

from benchmarks.table import Table

TARGET = Path(__file__).resolve().parents[1] / "docs" / "operate" / "drift.md"
MARKS = ("<!-- {} -->", "<!-- /{} -->")
"""Marks around a measured part of the page, with its name."""
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
DATED = {"8 %": "8 %", "5 %": "5 %", "2 %": "2 %", "slow": "0.5 % an event"}
"""Changes that are dated, and their names in the table."""
POOLED = ("scatter 1 to 2 %", "scatter 1 %", "scatter 2 %", "1 to 2 %, no thermometer")


def share(values: Sequence[bool]) -> str:
    """In percent, with its standard error."""
    p, count = float(np.mean(values)), len(values)
    return f"{100 * p:.1f} ± {100 * np.sqrt(max(p * (1 - p), 0.25 / count) / count):.1f}"


def within(trials: Sequence[Trial] | Sequence[PooledTrial], change: str, events: int) -> str:
    """Share of histories in which a change raises an alarm within this number of events."""
    return share([(n := one.found[change]) is not None and n <= events for one in trials])


def row(name: str, trials: Sequence[Trial]) -> tuple[str, ...]:
    """The row of one plan."""
    covered = [one.is_covered for one in trials if one.is_covered is not None]
    return (
        name,
        share([bool(one.healthy) for one in trials]),
        within(trials, "5 %", 2),
        within(trials, "5 %", 3),
        within(trials, "5 %", 5),
        within(trials, "8 %", 2),
        within(trials, "2 %", 10),
        within(trials, "2 %", 20),
        within(trials, "slow", 12),
        share([one.repair is not None and one.repair <= 3 for one in trials]),
        share(covered),
    )


def table_pooled(every: Mapping[str, Sequence[PooledTrial]]) -> Table:
    return Table(
        "Both directions together",
        f"The same rules test the mean of two directions whose scatter has a correlation of {SHARED}. Both have the "
        "same earthquakes, weather and loss.",
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


def table_of_dates(every: Mapping[str, Sequence[Mapping[str, Dating]]]) -> Table:
    return Table(
        "When a change began",
        f"For the histories, of {len(next(iter(every.values())))} random ones, in which the change was detected: the "
        "share of intervals that contain its beginning, in percent, and their length in events, median and 90th "
        "percentile.",
        ("histories", *(f"{name}, {what}" for name in DATED.values() for what in ("contains", "length"))),
        tuple(
            (
                name,
                *(
                    cell
                    for change in DATED
                    for found in [[one[change] for one in trials if change in one]]
                    for cell in (share([one.contains for one in found]), lengths([one.length for one in found]))
                ),
            )
            for name, trials in every.items()
        ),
    )


def lengths(values: Sequence[int]) -> str:
    return f"{np.median(values):.3g}, {np.percentile(values, 90):.3g}"


def tables(every: Mapping[str, Sequence[Trial]]) -> Iterator[Table]:
    count = len(next(iter(every.values())))
    yield Table(
        "Detected changes, and false alarms",
        f"Share of {count} random histories in which an alarm was raised, in percent, with its standard error. "
        '"5 % in 2" is a loss of 5 % that was detected within two events, of which the first is the first with the '
        "loss. The last column is the share of detected losses of 5 % whose interval contains the true size.",
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
            "interval contains 5 %",
        ),
        tuple(row(name, trials) for name, trials in every.items()),
    )
    yield Table(
        "False alarms by rule",
        "Share of the same histories, without a change, in which each rule raised an alarm.",
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
    """Write tables and pictures into docs/operate/drift.md, or with `--screen` print the tables only."""
    parser = ArgumentParser(prog="python -m benchmarks.drift", description=__doc__)
    parser.add_argument(
        "parts", nargs="*", default=["one", "both", "dated"], help="one direction, both together, when it began"
    )
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
            names = [name for name in given.plans if name in POOLED]
            joint = {name: list(executor.map(partial(trial_pooled, PLANS[name]), seeds, chunksize=8)) for name in names}
            parts["both"] = table_pooled(joint).markdown()
        if "dated" in given.parts:
            dates = {
                name: list(executor.map(partial(trial_of_dating, PLANS[name]), seeds, chunksize=8))
                for name in given.plans
            }
            parts["dated"] = table_of_dates(dates).markdown()
    for name, part in parts.items():
        print(part)
        if not given.screen:
            TARGET.write_text(renewed(TARGET.read_text(encoding="utf-8"), name, part), encoding="utf-8")


if __name__ == "__main__":
    main()
