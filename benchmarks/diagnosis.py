"""Trials of the diagnosis: effects hidden in a building, and false alarms.

    python -m benchmarks.diagnosis              all trials, into docs/models/diagnosis.md
    python -m benchmarks.diagnosis --quick      a few, onto the screen

Needs `pip install '.[test]'`. Every trial is kept in a file as it is done, so that a run that was stopped goes on where
it was. Thresholds were chosen on even seeds. The page reports odd ones from 501 on; smaller ones were looked at while
the diagnosis was written.
"""

import json
from argparse import ArgumentParser
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from rich.progress import track

from benchmarks.diagnosis_tables import GROUPS, Group, tables
from benchmarks.diagnosis_trial import Row, row
from benchmarks.table import with_results

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "models" / "diagnosis.md"
ROWS = ROOT / "build" / "diagnosis.jsonl"
PROCESSES = 2
CHOOSING, REPORTED = 0, 501
"""First seeds of the trials by which thresholds are chosen, and of those on the page; the next is larger by two."""


def wanted(groups: Iterable[Group], first: int, most: int) -> list[tuple[str, int]]:
    """Cases and seeds, each group's first ones first, so that a run that is stopped has some of each."""
    found = [
        (turn + number / len(group.cases), case, 2 * turn + first)
        for group in groups
        for turn in range(min(group.seeds, most))
        for number, case in enumerate(group.cases)
    ]
    return [(case, seed) for _, case, seed in sorted(found, key=lambda one: one[0])]


def run(trials: Sequence[tuple[str, int]], kept: Path) -> None:
    """Run the trials that are not kept yet; each is kept as soon as it is done.

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
    """Stored rows."""
    if not kept.exists():
        return []
    rows = [json.loads(line) for line in kept.read_text("utf-8").splitlines()]
    return [
        Row(**{name: _tuples(value) if isinstance(value, list) else value for name, value in one.items()})
        for one in rows
    ]


def _tuples(value: list[Any]) -> Any:  # noqa: ANN401  of names, or of tuples of names
    return tuple(tuple(one) if isinstance(one, list) else one for one in value)


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
    trials = wanted(groups, CHOOSING if given.choose else REPORTED, given.seeds)
    run(trials, given.rows)
    reported = set(trials)
    rows = [one for one in read(given.rows) if (one.case, one.seed) in reported]
    text = "\n".join(table.markdown() for table in tables(rows))
    if given.quick or given.choose:
        print(text)
        return
    PAGE.write_text(with_results(PAGE.read_text("utf-8"), "benchmarks.diagnosis", text), "utf-8")
    print(PAGE)


if __name__ == "__main__":
    main()
