"""Errors of every estimator for the real building's force, by the measured floors."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from accuracy import GOALS as ESTIMATORS_WITH_GOALS, Agreement, agreement
from real_building import BAND, GOALS, TESTS, best_instantaneous, inertia, superstructure

from benchmarks.force_tables import shown
from benchmarks.table import Table
from core.estimators import ESTIMATORS

ABOUT = f"""\
A five-storey building on rubber bearings on a shake table, in three recorded earthquakes. The force is estimated as the
product does (100 Hz), from the base slab and the named floors. The exact force is F = -Σ m_i a_i over all six levels.
Both are filtered to {BAND[0]:g} to {BAND[1]:g} Hz. Fit in % for {" / ".join(TESTS)}; in brackets the share of all
samples, in %, that the 95 % band covers, as the mean of the three. The best fixed weights of the same channels are
fitted to the exact force of the same test: no instantaneous combination of these channels can be better."""


@dataclass(frozen=True, slots=True)
class Found:
    """In one test, from one choice of floors."""

    floors: tuple[str, ...]
    test: str
    best: float
    """%, fit of the best fixed weights."""
    by_estimator: Mapping[str, Agreement]


def found_from(floors: tuple[str, ...]) -> tuple[Found, ...]:
    """One for each of TESTS."""
    return tuple(
        Found(
            floors,
            test,
            best_instantaneous(test, floors),
            {e: agreement(inertia(test), run(superstructure(test, floors))) for e, run in ESTIMATORS.items()},
        )
        for test in TESTS
    )


def table(found: Sequence[Found]) -> Table:
    """A row for every choice of floors."""
    rows = [_row(floors, [f for f in found if f.floors == floors]) for floors in dict.fromkeys(f.floors for f in found)]
    columns = ("floors", "goal", "best fixed weights", *ESTIMATORS)
    return Table("The real building, from different floors", ABOUT, columns, tuple(rows))


def _row(floors: tuple[str, ...], tests: Sequence[Found]) -> tuple[str, ...]:
    goals = GOALS.get(floors)
    return (
        "base, " + ", ".join(floors),
        "" if goals is None else " / ".join(f"{goal:g}" for goal in goals),
        " / ".join(shown(f.best) for f in tests),
        *(_cell(estimator, [f.by_estimator[estimator] for f in tests], goals) for estimator in ESTIMATORS),
    )


def _cell(estimator: str, tests: Sequence[Agreement], goals: Sequence[float] | None) -> str:
    judged = goals is not None and estimator in ESTIMATORS_WITH_GOALS
    fits = [shown(a.fit, a.fit > goal if judged else None) for a, goal in zip(tests, goals or (0.0,) * 3, strict=True)]
    return f"{' / '.join(fits)} ({100 * sum(a.coverage for a in tests) / len(tests):.0f})"
