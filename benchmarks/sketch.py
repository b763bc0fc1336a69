"""Trials of the sketch: laws outside the library hidden in a building, and nothing hidden.

    python -m benchmarks.sketch --seeds 3 --parity 1

Every trial is kept in a file as it is done, so that a run that was stopped goes on where it was. The limits of
core.sketching are choices, made on the simulated layers of its tests; even seeds were looked at in development, odd
ones are reported.
"""

import json
import sys
from argparse import ArgumentParser
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from time import process_time

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "support"))  # the generator is the tests'

from hidden.case import OUTSIDE
from hidden.trial import Trial, trial

from benchmarks.diagnosis_trial import analysed
from benchmarks.table import Table
from core.analysis import AnalysisSettings
from core.effects import EFFECTS, only
from core.model.first_model import first_model
from core.workbench.earthquakes import FITTED, HELD_OUT, Earthquakes, Recording, analysed as of_analysis, joined
from core.workbench.sketching import sketch

ROWS = Path(__file__).resolve().parents[1] / "build" / "sketch.jsonl"
LAWS = (*OUTSIDE, "two_masses")
"""No effect of the library has them; of two masses on springs it has one."""
NOTHING = "nothing"


@dataclass(frozen=True, slots=True)
class Row:
    """One trial, as it is kept."""

    case: str
    seed: int
    before: float
    """Noise ratio of the refitted model where it was held out."""
    proposed: tuple[str, ...]
    """Terms; none where nothing is proposed."""
    fitted: float
    """Share of the excess error that the law takes where it was fitted,"""
    held_out: float
    """and where it was held out; 0 where nothing is proposed."""
    ended: str
    seconds: float
    """Processor time of the sketch, s, compilation included."""


def row(case: str, seed: int) -> Row:
    """The trial of that case and seed, sketched."""
    made = trial(case, seed)
    seen, begun = _earthquakes(made), process_time()
    with only(EFFECTS):
        result = sketch(first_model(made.description).isolator, seen)
    names = seen.groups.get(HELD_OUT, seen.fitted_names)
    return Row(
        case,
        seed,
        result.versions[1].error(names).noise_ratio,
        () if result.proposal is None else tuple(one.term.name for one in result.proposal.law.placed),
        result.taken.get(FITTED, 0.0),
        result.taken.get(HELD_OUT, 0.0),
        result.ended,
        process_time() - begun,
    )


def _earthquakes(made: Trial) -> Earthquakes:
    """Earthquakes along x; those not for fitting are held out."""
    settings, reference = AnalysisSettings(), made.events[0].start
    each = [
        of_analysis(
            f"earthquake {number}",
            analysed(event, made),
            Recording((), made.description, settings, ("x",), reference),
        )
        for number, event in enumerate(made.events)
    ]
    later = [one.name for one in each[len(made.fitted) :]]
    return joined(each, made.description, settings.band, reference=reference, held_out=later)


def read(kept: Path) -> list[Row]:
    """Stored rows."""
    if not kept.exists():
        return []
    rows = [json.loads(line) for line in kept.read_text("utf-8").splitlines()]
    return [Row(**{**one, "proposed": tuple(one["proposed"])}) for one in rows]


def table(rows: list[Row]) -> Table:
    """Trials by case."""
    return Table(
        "Laws outside the library",
        "Share: the part of the excess error that the proposed law takes; 0 if no law was proposed.",
        ("hidden", "trials", "proposed", "takes half or more, held out", "median share, held out"),
        tuple(_lines(rows)),
    )


def _lines(rows: list[Row]) -> Iterator[tuple[str, ...]]:
    for case in (*LAWS, NOTHING):
        of = [one for one in rows if one.case == case]
        if not of:
            continue
        shares = sorted(one.held_out for one in of)
        counts = (sum(bool(one.proposed) for one in of), sum(one.held_out >= 0.5 for one in of))
        yield (case, str(len(of)), *map(str, counts), f"{100 * shares[len(shares) // 2]:.0f} %")


def main() -> None:
    """Run what is missing, and print the table."""
    parser = ArgumentParser(prog="python -m benchmarks.sketch", description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20, help="of each law; of nothing hidden ten times as many")
    parser.add_argument("--parity", type=int, choices=(0, 1), default=1, help="even seeds or odd ones")
    parser.add_argument("--rows", type=Path, default=ROWS, help="where the trials are kept")
    parser.add_argument("--most", type=int, default=None, help="end after so many trials")
    given = parser.parse_args()
    given.rows.parent.mkdir(parents=True, exist_ok=True)
    done = {(one.case, one.seed) for one in read(given.rows)}
    wanted = [
        (case, 2 * number + given.parity)
        for number in range(10 * given.seeds)
        for case in (*LAWS, NOTHING)
        if number < given.seeds or case == NOTHING
    ]
    with given.rows.open("a", encoding="utf-8") as lines:
        for one in [one for one in wanted if one not in done][: given.most]:
            lines.write(json.dumps(asdict(row(*one))) + "\n")
            lines.flush()
    print(table([one for one in read(given.rows) if one.seed % 2 == given.parity]).markdown())


if __name__ == "__main__":
    main()
