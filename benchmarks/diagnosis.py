"""Does a diagnosis name what is hidden in a building, and nothing else?

    python -m benchmarks.diagnosis              all trials, into docs/diagnosis.md
    python -m benchmarks.diagnosis --quick      a few, onto the screen

Needs `pip install '.[test]'`. Every trial is kept in a file as it is done, so that a run that was stopped goes on where
it was. Thresholds were chosen on even seeds; the page reports odd ones.
"""

import json
from argparse import ArgumentParser
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from math import isfinite
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from hidden.case import ANOTHER, FAULTS, OUTSIDE, PAIRS, SAME  # isort: skip  (benchmarks.diagnosis_trial finds it)
from rich.progress import track

from benchmarks.diagnosis_trial import Row, family, row
from benchmarks.table import Table

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "diagnosis.md"
ROWS = ROOT / "build" / "diagnosis.jsonl"
BEGIN, END = (f"<!-- {edge} of what `python -m benchmarks.diagnosis` writes -->" for edge in ("begin", "end"))
PROCESSES = 2
WEAK = 0.02
"""Misfit up to which a hidden law need not be seen."""


@dataclass(frozen=True, slots=True)
class Group:
    """Trials that are judged alike."""

    name: str
    cases: tuple[str, ...]
    seeds: int
    """How many of each case."""


GROUPS = (
    Group("same law", SAME, 6),
    Group("other law of the family", ANOTHER, 4),
    Group("outside the library", OUTSIDE, 6),
    Group("two effects", PAIRS, 2),
    Group("nothing hidden", ("nothing", "nothing+pink", "nothing+gains", "nothing+moving", "floor_masses"), 16),
    Group("design values off", ("refit",), 10),
    Group("a sensor errs", FAULTS, 2),
    Group("mass 10 % off", ("mass",), 20),
    Group("a storey softened", ("storey",), 20),
)
"""The usual trials; their seeds are odd, those that thresholds are chosen by even."""


def wanted(groups: Iterable[Group], parity: int, most: int) -> list[tuple[str, int]]:
    """Cases and seeds, each group's first ones first, so that a run that is stopped has some of each."""
    found = [
        (turn + number / len(group.cases), case, 2 * turn + parity)
        for group in groups
        for turn in range(min(group.seeds, most))
        for number, case in enumerate(group.cases)
    ]
    return [(case, seed) for _, case, seed in sorted(found, key=lambda one: one[0])]


def run(trials: Sequence[tuple[str, int]], kept: Path) -> None:
    """Those that are not kept yet; each is kept as soon as it is done.

    Raises:
        ExceptionGroup: when all others are done, of the trials that failed.
    """
    kept.parent.mkdir(parents=True, exist_ok=True)
    there = {(one.case, one.seed) for one in read(kept)}
    missing, failed = [one for one in trials if one not in there], list[Exception]()
    with ProcessPoolExecutor(PROCESSES, get_context("spawn")) as pool, kept.open("a", encoding="utf-8") as lines:
        waiting = {pool.submit(row, *one): one for one in missing}
        try:
            for done in track(as_completed(waiting), "diagnosing", total=len(missing)):
                if isinstance(error := done.exception(), Exception):
                    error.add_note("in the trial {}, seed {}".format(*waiting[done]))
                    failed.append(error)
                    continue
                lines.write(json.dumps(asdict(done.result())) + "\n")
                lines.flush()
        except BaseException:  # else those that wait would be run first, and nobody keep them
            pool.shutdown(cancel_futures=True)
            raise
    if failed:
        raise ExceptionGroup("trials that failed", failed)


def read(kept: Path) -> list[Row]:
    """What was kept."""
    if not kept.exists():
        return []
    rows = [json.loads(line) for line in kept.read_text("utf-8").splitlines()]
    return [
        Row(**{name: _tuples(value) if isinstance(value, list) else value for name, value in one.items()})
        for one in rows
    ]


def _tuples(value: list[Any]) -> Any:  # noqa: ANN401  of names, or of tuples of names
    return tuple(tuple(one) if isinstance(one, list) else one for one in value)


def tables(rows: Sequence[Row]) -> list[Table]:
    """What the page shows."""
    of = {group.name: [one for one in rows if one.case in group.cases] for group in GROUPS}
    same, other, outside, two, nothing, refit, faults, mass, storey = of.values()
    strong = [one for one in same if one.misfit > WEAK]
    others = [one for one in other if one.misfit > WEAK]
    weak = [one for one in same if one.misfit <= WEAK]
    far = [one for one in outside if one.misfit > WEAK]
    erring, softened = (lambda o: o.outcome == "sensor_fault"), (lambda o: o.outcome == "superstructure")
    asked = (
        ("same law, misfit > 2 %: named first", "≥ 98 %", _share(strong, _named_first)),
        ("same law, misfit > 2 %: another named first", "≤ 1 %", _share(strong, _misnamed)),
        ("same law, misfit > 2 %: nothing more named", "", _share(strong, lambda o: len(o.named) <= 1)),
        ("same law, misfit > 2 %: the set holds it", "≥ 98 %", _share(strong, _in_set)),
        ("same law, misfit > 2 %: size of the set", "≤ 1.5", _mean(len(o.sets[0]) for o in strong if o.sets)),
        ("same law, misfit > 2 %: residual / floor, median", "≤ 1.02", _quantile(strong, 0.5)),
        ("same law, misfit > 2 %: residual / floor, 90 %", "≤ 1.10", _quantile(strong, 0.9)),
        ("same law, misfit ≤ 2 %: another named", "", _share(weak, _misnamed)),
        ("other law, misfit > 2 %: family named first", "≥ 95 %", _share(others, _family_first)),
        ("other law, misfit > 2 %: residual / floor, 90 %", "", _quantile(others, 0.9)),
        ("outside, misfit > 2 %: flagged as unknown", "≥ 95 %", _share(far, lambda o: o.unknown)),
        ("nothing hidden: an effect named", "≤ 1 %", _share(nothing, _blamed)),
        ("nothing hidden: sensor, mass or storey suspected", "≤ 1 %", _share(nothing, lambda o: bool(o.suspects))),
        ("design values off: refit", "", _share(refit, lambda o: o.outcome == "refit")),
        ("two effects: both and no other", "≥ 90 %", _share(two, lambda o: set(o.named) == set(o.hidden))),
        ("a sensor errs: outcome sensor_fault", "≥ 95 %", _share(faults, erring)),
        ("a sensor errs: kind and channel's kind named", "≥ 95 %", _share(faults, _sensor_named)),
        ("a sensor errs: an effect blamed", "0", _share(faults, _blamed)),
        ("mass 10 % off: outcome mass", "≥ 95 %", _share(mass, lambda o: o.outcome == "mass")),
        ("mass 10 % off: an effect blamed", "0", _share(mass, _blamed)),
        ("a storey softened: outcome superstructure", "≥ 95 %", _share(storey, softened)),
        ("a storey softened: an effect blamed", "0", _share(storey, _blamed)),
        ("new earthquake, same law: displacement NRMSE, median", "≤ 1 %", _percent(_predicted(strong))),
        ("the same, the model as it was given, fitted", "", _percent([o.predicted_before for o in strong])),
        ("new earthquake, other law: displacement NRMSE, median", "≤ 3 %", _percent(_predicted(others))),
        ("processor time of a diagnosis, median", "1 s", _seconds(rows)),
    )
    about = f"{len(rows)} trials with odd seeds: another building, other motions and other values in each."
    return [Table("What the diagnosis made of hidden effects", about, ("what", "goal", "reached"), asked)]


def _named_first(one: Row) -> bool:
    return one.named[:1] == one.hidden[:1]


def _misnamed(one: Row) -> bool:
    return bool(one.named) and not _named_first(one)


def _blamed(one: Row) -> bool:
    """Whether the outcome is an effect, or several."""
    return one.outcome in {"effect", "family", "one_of_set"}


def _family_first(one: Row) -> bool:
    return bool(one.named) and family(one.named[:1]) == family(one.hidden)


def _in_set(one: Row) -> bool:
    return bool(one.sets) and one.hidden[0] in one.sets[0]


def _sensor_named(one: Row) -> bool:
    return any(suspect.split("@")[0] == one.case.split("@")[0] for suspect in one.suspects)


def _share(rows: Sequence[Row], is_so: Callable[[Row], bool]) -> str:
    count = sum(map(is_so, rows))
    return f"{100 * count / len(rows):.1f} % ({count} of {len(rows)})" if rows else "none run"


def _quantile(rows: Sequence[Row], share: float) -> str:
    left = [one.after for one in rows if isfinite(one.after)]
    return f"{np.quantile(left, share):.3f}" if left else "none run"


def _mean(values: Iterable[float]) -> str:
    every = list(values)
    return f"{np.mean(every):.2f}" if every else "none run"


def _predicted(rows: Sequence[Row]) -> list[float]:
    return [one.predicted for one in rows if isfinite(one.predicted)]


def _percent(values: Sequence[float]) -> str:
    finite = [one for one in values if isfinite(one)]
    return f"{100 * np.median(finite):.2f} %" if finite else "none run"


def _seconds(rows: Sequence[Row]) -> str:
    return f"{np.median([one.seconds for one in rows]):.1f} s" if rows else "none run"


def main() -> None:
    """Run what is missing, and write the page."""
    parser = ArgumentParser(prog="python -m benchmarks.diagnosis", description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="one seed of a few cases, onto the screen")
    parser.add_argument(
        "--choose", action="store_true", help="even seeds, by which thresholds are chosen; onto the screen"
    )
    parser.add_argument("--seeds", type=int, default=100, help="at most so many of each case")
    parser.add_argument("--rows", type=Path, default=ROWS, help="where the trials are kept")
    given = parser.parse_args()
    groups = [Group(g.name, g.cases[:2], 1) for g in GROUPS] if given.quick else GROUPS
    parity = 0 if given.choose else 1
    run(wanted(groups, parity, given.seeds), given.rows)
    rows = [one for one in read(given.rows) if one.seed % 2 == parity]
    text = "\n".join(table.markdown() for table in tables(rows))
    if given.quick or given.choose:
        print(text)
        return
    before, after = PAGE.read_text("utf-8").split(BEGIN)[0], PAGE.read_text("utf-8").split(END)[1]
    PAGE.write_text(f"{before}{BEGIN}\n\n{text}\n{END}{after}", "utf-8")
    print(PAGE)


if __name__ == "__main__":
    main()
