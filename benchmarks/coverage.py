"""Coverage and width of the 95 % bands of force, displacement and k_eq.

    python -m benchmarks.coverage            weak events (odd seeds), the real building: docs/reference/accuracy.md
    python -m benchmarks.coverage --full     strong events too, onto the screen
    python -m benchmarks.coverage --seed 0   weak events of another seed, onto the screen

Constants were chosen on even seeds, and on the first of the real building's records: odd ones are reported. Needs
`pip install '.[test]'`, and the real building's records beside the checkout (../shared/data/bncs).
"""

import sys
from argparse import ArgumentParser
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from statistics import fmean
from typing import TypeVar

from rich.console import Console
from rich.progress import track

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / "tests" / "support"))  # truths are those of the tests

from band_coverage import (  # noqa: E402
    DRAWN,
    NOISES,
    PEAKS,
    TRUTHS,
    Case,
    Coverage,
    Share,
    coverage,
    demonstration_coverage,
    real_building_coverage,
)
from real_building import SUBSETS, TESTS  # noqa: E402
from shared_data import BNCS  # noqa: E402

from benchmarks.force_tables import shown  # noqa: E402
from benchmarks.table import Table, with_results  # noqa: E402

PAGE = ROOT / "docs" / "reference" / "accuracy.md"
WANTED = (90.0, 98.0)
"""%, between which a share is to lie."""
MOTIONS = ("AKT013", "Kobe")
"""The second in full only."""
REPORTED = 1
"""The seed of the tables in docs/reference/accuracy.md."""
FURTHER = tuple(range(3, 25, 2))
"""Seeds of more buildings, of the truths whose building is drawn."""
PROCESSES = 2
ABOUT = """\
Share of the samples, in %, whose error is within 1.96 standard deviations (for k_eq, of the cycles, relative to the
describing function). In brackets: root mean square of the standard deviation / of the error, in % of that of the force
or displacement. The whole analysis; means over {motions} at {peaks} gal. **Bold**: outside 90 to 98 %."""
REAL_ABOUT = """\
Force from the base slab and the named floors, compared with F = -Σ m_i a_i over all six levels, for {tests}. This
reference contains the noise of the same sensors. If most floors are measured, the band is therefore wider than the
difference."""

Job = TypeVar("Job")
Result = TypeVar("Result")
DEMONSTRATED = (0, 5, 11, 20, 30)
"""Places of the demonstration's motions that its table has."""
DEMONSTRATED_ABOUT = """\
Force from the base slab and two floors, with the demonstration's own sensors, whose noise is about a thousandth of
their signal. The ground motion has a peak of 100 gal. The second line of a motion is its strong part, above 20 % of the
peak force. The reference is the same estimate from all floors without noise."""

Found = tuple[Case, Coverage, Coverage]
"""By `smoother` with a transducer, and by `cms` without."""
WAYS = {
    1: "the smoother, displacement by a transducer and accelerometers",
    2: "cms, displacement integrated from accelerations",
}
"""By their place in these."""


def both(case: Case) -> Found:
    """Both ways on one record."""
    return case, coverage(case), coverage(case, "cms", transducer=False)


def real(floors: tuple[str, ...]) -> tuple[tuple[str, ...], tuple[Share, ...]]:
    """The force of every test from one choice of floors."""
    return floors, tuple(real_building_coverage(test, floors) for test in TESTS)


def truths_table(title: str, found: Sequence[Found], noises: Sequence[float], way: int) -> Table:
    """A row for every truth and quantity, a column for every noise."""
    rows = []
    for truth in dict.fromkeys(case.truth for case, *_ in found):
        at = [[one[way] for one in found if (one[0].truth, one[0].noise) == (truth, noise)] for noise in noises]
        rows.append((truth, "force", *(_mean(one.force for one in each) for each in at)))
        rows.append(("", "in strong motion", *(_mean(one.strong for one in each) for each in at)))
        rows.append(("", "displacement", *(_mean(one.displacement for one in each) for each in at)))
        rows.append(("", "k_eq", *(_cycles(each) for each in at)))
    motions, peaks = (", ".join(dict.fromkeys(names)) for names in _run(found))
    about = ABOUT.format(motions=motions, peaks=peaks)
    return Table(title, about, ("truth", "quantity", *(f"{100 * noise:g} %" for noise in noises)), tuple(rows))


def real_table(found: Iterable[tuple[tuple[str, ...], tuple[Share, ...]]]) -> Table:
    """A row for every choice of floors."""
    rows = tuple(("base, " + ", ".join(floors), *(_mean([one]) for one in shares)) for floors, shares in found)
    rows += (("mean of all", *(_mean(each) for each in zip(*(shares for _, shares in found), strict=True))),)
    return Table("Bands on the real building", REAL_ABOUT.format(tests=", ".join(TESTS)), ("floors", *TESTS), rows)


def demonstrated_table(found: Iterable[tuple[str, dict[str, tuple[Share, Share]]]]) -> Table:
    """Two rows for every motion, a column for each direction."""
    rows = []
    for name, shares in found:
        rows.append((name, *(_mean([whole]) for whole, _ in shares.values())))
        rows.append(("", *(_mean([strong]) for _, strong in shares.values())))
    return Table("Bands in the demonstration", DEMONSTRATED_ABOUT, ("motion", "x", "y"), tuple(rows))


def _run(found: Sequence[Found]) -> tuple[list[str], list[str]]:
    return [case.motion for case, *_ in found], [f"{case.peak:g}" for case, *_ in found]


def _mean(shares: Iterable[Share | None]) -> str:
    known = [share for share in shares if share is not None]
    if not known:
        return "-"
    width, error = (100 * fmean(values) for values in zip(*((s.width, s.error) for s in known), strict=True))
    return f"{_marked(100 * fmean(share.inside for share in known))} ({width:.2g} / {error:.2g})"


def _cycles(found: Sequence[Coverage]) -> str:
    count = sum(one.cycles for one in found)
    return f"{_marked(100 * sum(one.k_inside for one in found) / count)} of {count}" if count else "-"


def _marked(percent: float) -> str:
    return shown(percent, WANTED[0] <= percent <= WANTED[1], 1)


def report(cases: Sequence[Case], further: Sequence[Case], floors: Sequence[tuple[str, ...]], console: Console) -> str:
    """All tables, one below the other.

    Args:
        cases: of the tables of every truth.
        further: of the table of several buildings, beside those of `cases`.
        floors: measured on the real building.
        console: for progress.
    """
    with ProcessPoolExecutor(PROCESSES, get_context("spawn")) as pool:
        every = [*cases, *further]
        found = _all(pool, both, every, "simulated", console)
        of_demo = _all(pool, demonstration_coverage, DEMONSTRATED, "demonstration", console)
        on_it = _all(pool, real, floors, "real", console) if BNCS.is_dir() else []
    noises, first = list(dict.fromkeys(case.noise for case in cases)), found[: len(cases)]
    tables = [truths_table(f"Bands of {title}", first, noises, way) for way, title in WAYS.items()]
    if further:
        drawn, seeds = [one for one in found if one[0].truth in DRAWN], sorted({case.seed for case in every})
        named = f", mean of {len(seeds)} buildings (odd seeds {seeds[0]} to {seeds[-1]})"
        tables += [truths_table(f"Bands of {title}{named}", drawn, noises, way) for way, title in WAYS.items()]
    return "\n".join(
        table.markdown() for table in [*tables, demonstrated_table(of_demo), *([real_table(on_it)] if on_it else [])]
    )


def _all(
    pool: ProcessPoolExecutor, work: Callable[[Job], Result], jobs: Sequence[Job], title: str, console: Console
) -> list[Result]:
    return list(track(pool.map(work, jobs), title, total=len(jobs), console=console))


def main() -> None:
    """Run, and show or write."""
    parser = ArgumentParser(description="Coverage of the 95 % bands.")
    parser.add_argument("--full", action="store_true", help="strong events too, onto the screen")
    parser.add_argument("--seed", type=int, help="another seed, onto the screen")
    asked = parser.parse_args()
    seed = REPORTED if asked.seed is None else asked.seed
    drawn = FURTHER if asked.seed is None and not asked.full else ()
    peaks, motions = ((PEAKS[0], PEAKS[-1]), MOTIONS) if asked.full else (PEAKS[:1], MOTIONS[:1])
    floors = SUBSETS[:-1] if asked.seed is None else ()
    cases = [Case(t, m, p, n, seed) for t in TRUTHS for m in motions for p in peaks for n in NOISES]
    further = [Case(t, MOTIONS[0], PEAKS[0], n, s) for t in DRAWN for n in NOISES for s in drawn]
    tables = report(cases, further, floors, Console(stderr=True))
    if asked.full or asked.seed is not None:
        print(tables)
        return
    PAGE.write_text(with_results(PAGE.read_text("utf-8"), "benchmarks.coverage", tables), "utf-8")


if __name__ == "__main__":
    main()
