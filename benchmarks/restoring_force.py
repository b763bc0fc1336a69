"""Errors of the estimators of the restoring force, for simulated buildings and a real one.

    python -m benchmarks.restoring_force            all of it, into docs/reference/accuracy.md
    python -m benchmarks.restoring_force --quick    two motions, one seed, onto the screen

Needs `pip install '.[test]'`, and the real building's records beside the checkout (../shared/data/bncs).
"""

import sys
from argparse import ArgumentParser
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path

from rich.console import Console
from rich.progress import track

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / "tests" / "support"))  # truths and goals are those that the tests hold to

from accuracy import NOISES, Score, long_enough, scores  # noqa: E402
from exact_responses import KINDS, MOTIONS, as_prepared, exact_response  # noqa: E402
from real_building import SUBSETS  # noqa: E402
from shared_data import BNCS  # noqa: E402

from benchmarks import cycle_errors, floors_measured, force_tables  # noqa: E402
from benchmarks.table import with_results  # noqa: E402
from core.comparison.misfit import fitting_rate  # noqa: E402
from core.estimators import ESTIMATORS  # noqa: E402

PAGE = ROOT / "docs" / "reference" / "accuracy.md"
PROCESSES = 2


@dataclass(frozen=True, slots=True)
class Extent:
    """Extent of a run."""

    motions: tuple[str, ...]
    noises: tuple[float, ...]
    seeds: tuple[int, ...]
    floors: tuple[tuple[str, ...], ...]


FULL = Extent(tuple(MOTIONS), NOISES, (0, 1), SUBSETS)
QUICK = Extent(("Kobe", "AKT013"), (NOISES[0], NOISES[-1]), (0,), (("4", "roof"), ("roof",)))


@dataclass(frozen=True, slots=True)
class OnTruth:
    """On one truth."""

    kind: str
    scores: tuple[Score, ...]
    band_alone: float | None
    """%, fit of the exact force within the product's band to the exact force; None where it is too short for it."""


def on_truth(kind: str, motion: str, extent: Extent) -> OnTruth:
    """Every estimator on one truth."""
    force = exact_response(KINDS[kind], motion).force
    found = tuple(scores(kind, motion, extent.noises, extent.seeds))
    return OnTruth(kind, found, fitting_rate(force, as_prepared(force)) if long_enough(force) else None)


def report(extent: Extent, console: Console) -> str:
    """All tables, one below the other."""
    parts: list[Callable[[], object]] = [partial(on_truth, k, m, extent) for k in KINDS for m in extent.motions]
    parts += [partial(cycle_errors.cycle_errors, e, n) for e in ESTIMATORS for n in (0.01, 0.10)]
    if BNCS.is_dir():
        parts += [partial(floors_measured.found_from, floors) for floors in extent.floors]
    results = in_parallel(parts, console)
    simulated = [r for r in results if isinstance(r, OnTruth)]
    band_alone = {k: [r.band_alone for r in simulated if r.kind == k and r.band_alone] for k in KINDS}
    found = [s for r in simulated for s in r.scores]
    cycles = [r for r in results if isinstance(r, cycle_errors.CycleErrors)]
    floors = [f for r in results if isinstance(r, tuple) for f in r]
    tables = [*force_tables.tables(found, band_alone), cycle_errors.table(cycles)]
    if floors:
        tables.append(floors_measured.table(floors))
    return "\n".join([opening(extent), *(table.markdown() for table in tables)])


def opening(extent: Extent) -> str:
    """Opening of the page: motions, noise and draws."""
    return (
        f"Recorded motions, scaled to 70 gal: {', '.join(extent.motions)}. White noise of "
        f"{', '.join(f'{100 * noise:g}' for noise in extent.noises)} % of each channel's root mean square. "
        f"Number of draws of the noise, and of random masses: {len(extent.seeds)}.\n"
    )


def in_parallel(parts: Sequence[Callable[[], object]], console: Console) -> list[object]:
    """The results in order, each part in one of a few processes."""
    with ProcessPoolExecutor(PROCESSES, get_context("spawn")) as pool:
        futures = [pool.submit(part) for part in parts]
        for future in track(as_completed(futures), "estimating", total=len(futures), console=console):
            future.result()
        return [future.result() for future in futures]


def main() -> None:
    """Run, and show or write."""
    parser = ArgumentParser(description="Accuracy of the restoring force's estimators.")
    parser.add_argument("--quick", action="store_true", help="two motions and one seed, onto the screen")
    console = Console(stderr=True)
    if parser.parse_args().quick:
        print(report(QUICK, console))
    else:
        PAGE.write_text(
            with_results(PAGE.read_text("utf-8"), "benchmarks.restoring_force", report(FULL, console)), "utf-8"
        )


if __name__ == "__main__":
    main()
