"""Tables of the scores of the restoring force's estimators, with each goal."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from statistics import fmean, median
from typing import TypeVar

from accuracy import COVERED, GOALS, NOISES, Score

from benchmarks.table import Table

STATIC = "cms"
"""The estimator that interpolates statically: what no other may do worse than."""
LIKE = "in class"
"""The kind of truth that the estimators' models describe."""

Name = TypeVar("Name")
Cell = Callable[[Sequence[Score]], str]
"""The text for scores that have row, estimator and noise in common."""


def tables(scores: Sequence[Score], band_alone: Mapping[str, Sequence[float]]) -> tuple[Table, ...]:
    """All that the simulated buildings say.

    Args:
        scores: of every estimator on the same records.
        band_alone: by kind of truth, fits in % of the exact force within the product's band to the exact force.
    """
    return (
        _table("Truths like the model", LIKE_ABOUT, [s for s in scores if s.kind == LIKE], "motion", _fit),
        _table("Truths unlike the model, and faulty sensors", UNLIKE_ABOUT, scores, "kind", _fit),
        _table("What the standard deviation covers", COVERED_ABOUT, scores, "kind", _covered),
        _beside_static(scores),
        _filtered(scores, band_alone),
        _times(scores),
    )


LIKE_ABOUT = """\
Buildings of the model's class. Fit of the estimated force to the exact one in %, by estimator and percentage of noise:
the worst of the seeds (their mean). The estimators get the unfiltered channels of the base slab, the fourth storey and
the roof, and the fit is over all 180 s."""
UNLIKE_ABOUT = """\
The same for other buildings and for faulty sensors: the worst of motions and seeds (their mean). The estimators get the
design's masses, whose total is right, and no stiffness. Random masses are drawn anew for every seed."""
COVERED_ABOUT = f"""\
Share of the samples, in %, at which the exact force lies within 1.96 standard deviations of the estimate: over the
whole record / in strong motion (5 to 95 % of the force's energy) / over the whole record with the product's filters
(see below). The values are means over motions and seeds. Goal: {100 * COVERED[0]:.0f} to {100 * COVERED[1]:.0f} %."""
STATIC_ABOUT = f"""\
Fit minus the fit of `{STATIC}` on the same record, in percentage points: the smallest difference, and the number of
records on which it is negative. Goal: none."""
FILTERED_ABOUT = """\
The product removes the baseline and filters to 0.1 to 30 Hz before it estimates. Fit in % to the exact force within the
same band: the worst of motions (their mean), with one draw of the noise. The last column shows what this band alone
costs: the fit of the exact force within the band to the exact force. A record shorter than 20 s cannot be filtered."""
TIMES_ABOUT = """\
Processor time, in ms, of one estimate of the force of a building of the model's class, 180 s at 100 Hz, on one thread:
median and longest of all motions, noises and seeds. Screening, the layer's motion and the cycles are not included. Two
estimates ran at once, and other programs beside them, so these times are upper bounds. They must not be compared with
the whole chain in [Benchmarks](benchmarks.md#the-whole-chain-for-one-event), which was measured at another load."""


def shown(value: float, reached: bool | None = None, digits: int = 2) -> str:
    """A number; bold where it misses its goal."""
    return f"**{value:.{digits}f}**" if reached is False else f"{value:.{digits}f}"


def asked(estimator: str, noise: float, kind: str) -> float | None:
    """Goal in %; None where there is none."""
    if estimator not in GOALS:
        return None
    return GOALS[estimator].in_class[NOISES.index(noise)] if kind == LIKE else GOALS[estimator].outside


def _table(title: str, about: str, scores: Sequence[Score], row: str, cell: Cell) -> Table:
    """A row for every value of an attribute, a column for every estimator and noise; the goals last."""
    estimators, noises = _names(s.estimator for s in scores), _names(s.noise for s in scores)
    columns = [(e, n) for e in estimators for n in noises]
    rows = [
        (name, *(cell([s for s in scores if (getattr(s, row), s.estimator, s.noise) == (name, *c)]) for c in columns))
        for name in _names(getattr(s, row) for s in scores)
    ]
    if cell is _fit:
        kind = LIKE if row == "motion" else "outside"
        goals = [asked(*column, kind) for column in columns]
        rows.append((f"goal, {kind}", *("" if goal is None else f"{goal:g}" for goal in goals)))
    return Table(title, about, (row, *(f"{e}, {100 * n:g} %" for e, n in columns)), tuple(rows))


def _fit(group: Sequence[Score]) -> str:
    return _worst_and_mean([s.measured.fit for s in group], asked(group[0].estimator, group[0].noise, group[0].kind))


def _filtered_fit(group: Sequence[Score]) -> str:
    fits = [s.filtered.fit for s in group if s.filtered]
    return _worst_and_mean(fits, asked(group[0].estimator, group[0].noise, group[0].kind)) if fits else "-"


def _worst_and_mean(fits: Sequence[float], goal: float | None) -> str:
    return f"{shown(min(fits), None if goal is None else min(fits) >= goal)} ({shown(fmean(fits))})"


def _covered(group: Sequence[Score]) -> str:
    measured, filtered = [s.measured for s in group], [s.filtered for s in group if s.filtered]
    shares = (
        fmean(a.coverage for a in measured),
        fmean(a.strong_coverage for a in measured),
        fmean(a.coverage for a in filtered),
    )
    judged = group[0].estimator in GOALS
    low, high = COVERED
    return " / ".join(shown(100 * share, low <= share <= high if judged else None, digits=1) for share in shares)


def _filtered(scores: Sequence[Score], band_alone: Mapping[str, Sequence[float]]) -> Table:
    table = _table("With the product's filters", FILTERED_ABOUT, scores, "kind", _filtered_fit)
    rows = tuple((*row, shown(min(fits)) if (fits := band_alone[row[0]]) else "-") for row in table.rows)
    return Table(table.title, table.about, (*table.columns, "the band alone"), rows)


def _beside_static(scores: Sequence[Score]) -> Table:
    static = {_record(s): s for s in scores if s.estimator == STATIC}
    others = [(s, static[_record(s)]) for s in scores if s.estimator != STATIC]
    rows = []
    for estimator, kind in _names((s.estimator, s.kind) for s, _ in others):
        pairs = [(s, c) for s, c in others if (s.estimator, s.kind) == (estimator, kind)]
        measured = _smallest([s.measured.fit - c.measured.fit for s, c in pairs])
        filtered = _smallest([s.filtered.fit - c.filtered.fit for s, c in pairs if s.filtered and c.filtered])
        rows.append((estimator, kind, measured, filtered))
    columns = ("estimator", "kind", "unfiltered", "with the filters")
    return Table("Beside static interpolation", STATIC_ABOUT, columns, tuple(rows))


def _smallest(gains: Sequence[float]) -> str:
    if not gains:
        return "-"
    worse = sum(gain < 0 for gain in gains)
    return f"{shown(min(gains), worse == 0)} ({worse} of {len(gains)})"


def _times(scores: Sequence[Score]) -> Table:
    rows = []
    for estimator in _names(s.estimator for s in scores):
        took = [1e3 * s.seconds for s in scores if (s.estimator, s.kind) == (estimator, LIKE)]
        rows.append((estimator, f"{median(took):.0f}", f"{max(took):.0f}"))
    return Table("Time", TIMES_ABOUT, ("estimator", "median", "longest"), tuple(rows))


def _record(score: Score) -> tuple[str, str, float, int]:
    return score.kind, score.motion, score.noise, score.seed


def _names(of: Iterable[Name]) -> list[Name]:
    return list(dict.fromkeys(of))
