"""Search for the few terms that explain what a model leaves over.

The model's own parameters stay free: their derivatives are projected out of the residual and of every term. Terms are
taken one after the other, several beginnings side by side; the number of terms is chosen by the error in earthquakes,
or in parts of one, to which nothing was fitted.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np
from scipy import linalg

from core.arrays import Matrix, Vector
from core.diagnosis.ranking import DECISIVE
from core.diagnosis.worth import excess
from core.fitting.data import FitData
from core.fitting.fit import Fit, tangents
from core.fitting.noise import noise_rms
from core.sketching.terms import TERMS, Scales, Term, histories, scales_of

MOST_TERMS = 3
"""Terms of a law at most. A choice: more would be no sketch."""
BEAM = 5
"""Beginnings that are followed side by side. A choice."""
LEAST_SHARE = 0.05
"""Smallest share of the residual's power that a sketch takes. A choice: noise whose spectrum is not known well gives a
few percent to the best of all terms."""
SIMPLER = 0.1
"""Share of the excess error by which a simpler law may fall behind. A choice."""
FIRST_MOVE, MOVES = 1.3, 4
"""Factor on a term's own value in the first of so many rounds of refinement; its root is taken after each. A choice:
starts are a factor of two apart."""
PARTS = 5
"""Parts of a single earthquake, for the validation. A choice."""
ALIKE = 0.98
"""Correlation of two terms' traces from which on records do not distinguish them. A choice."""


@dataclass(frozen=True, slots=True)
class Placed:
    """A term at a value of its own."""

    term: Term
    s: float
    """Its length, speed, time or travel, SI; 0 for none."""


@dataclass(frozen=True, slots=True, eq=False)
class Library:
    """All terms at all their starting values, as the records see them."""

    scales: Scales
    placed: tuple[Placed, ...]
    columns: Matrix
    """(k, m) whitened, for 1 N."""
    own: Matrix
    """(k, m) the same without what the model's parameters can do, of length 1."""
    sizes: Vector
    """(k,) lengths before."""


@dataclass(frozen=True, slots=True, eq=False)
class Sketched:
    """A law: terms with amplitudes, by a linear regression."""

    placed: tuple[Placed, ...]
    amplitudes: Vector
    """(k,) N."""
    taken: float
    """Share of the residual's power that it takes where it was fitted."""
    delta_bic: float
    """ΔBIC against the model alone, the price of the choice among all terms included."""
    predicted: float
    """Share of the excess error that it takes where nothing was fitted; at most 1, negative where it does harm."""
    alike: tuple[str, ...]
    """Names of single terms that leave nearly the same trace as one of these."""


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """Best laws by their number of terms: of each number that which takes most, and that which predicts most."""

    by_size: tuple[Sketched, ...]
    """The simplest first."""
    noise_ratio: float
    """Noise ratio of the model without a sketch."""

    @property
    def supported(self) -> tuple[Sketched, ...]:
        """Laws in the order in which they are tried: the simplest that predicts nearly as much as the best, then the
        others, those that predict most first."""
        left = [
            one for one in self.by_size if one.delta_bic < -DECISIVE and one.taken > LEAST_SHARE and one.predicted > 0
        ]
        if not left:
            return ()
        best = max(one.predicted for one in left)
        first = next(one for one in left if one.predicted >= best - SIMPLER)
        return (first, *sorted((one for one in left if one is not first), key=lambda one: -one.predicted))


def library(data: FitData, fit: Fit) -> Library:
    """All terms for records, beside a fit of the model to them."""
    scales = scales_of(data.observations)
    rows, placed = [], []
    for term in TERMS:
        for share in term.starts or (0.0,):
            s = scales.start(term, share)
            placed.append(Placed(term, s))
            rows.append(_column(placed[-1], scales, data))
    columns = np.array(rows)
    whole = np.linalg.norm(columns, axis=1)
    basis = own_basis(data, fit)
    apart = columns - (columns @ basis) @ basis.T
    sizes = np.linalg.norm(apart, axis=1)
    kept = sizes > 1e-3 * np.maximum(whole, 1e-300)
    return Library(
        scales,
        tuple(one for one, keep in zip(placed, kept, strict=True) if keep),
        columns[kept],
        apart[kept] / sizes[kept, None],
        sizes[kept],
    )


def _column(one: Placed, scales: Scales, data: FitData) -> Vector:
    """(m,) a term of 1 N as the records see it, whitened."""
    each = zip(histories(one.term, one.s, scales, data.observations), data.whitenings, strict=True)
    return np.concatenate([w.whitened(w.filtered(history[None]))[0] for history, w in each])


def own_basis(data: FitData, fit: Fit) -> Matrix:
    """(m, p) orthonormal, of what the model's parameters can do."""
    turned = tangents(data, fit)
    size = np.linalg.norm(turned, axis=1)
    return np.asarray(linalg.orth((turned[size > 0] / size[size > 0, None]).T))


def search(data: FitData, fit: Fit, noise: Vector, inflation: float) -> tuple[Library, Found]:
    """Best laws of one to MOST_TERMS terms for what a fit leaves over.

    Args:
        data: the records.
        fit: of the model to them.
        noise: (records,) N, root mean square of the measured force's noise.
        inflation: τ of the fit, by which the residual counts as fewer independent values.
    """
    terms = library(data, fit)
    basis = own_basis(data, fit)
    residual = fit.residual - basis @ (basis.T @ fit.residual)
    judge = _Judge.of(data, fit, noise)
    beams: list[tuple[int, ...]] = [()]
    by_size: list[Sketched] = []
    for _ in range(MOST_TERMS):
        beams = _longer(beams, terms, residual)
        if not beams:
            break
        tried = [_sketched(one, terms, residual, judge, inflation) for one in beams]
        best = dict.fromkeys((max(tried, key=lambda one: one.taken), max(tried, key=lambda one: one.predicted)))
        by_size += [_refined(one, data, terms, basis, residual, judge, inflation) for one in best]
    return terms, Found(tuple(by_size), judge.noise_ratio)


def _longer(beams: Sequence[tuple[int, ...]], terms: Library, residual: Vector) -> list[tuple[int, ...]]:
    """The best beginnings with one term more, each of another kind."""
    gains: dict[tuple[int, ...], float] = {}
    for beam in beams:
        basis = linalg.orth(terms.own[list(beam)].T) if beam else np.zeros((residual.size, 0))
        left = residual - basis @ (basis.T @ residual)
        shared = terms.own @ basis
        size = np.sqrt(np.maximum(1 - np.sum(shared**2, axis=1), 1e-6))
        gain = (terms.own @ left / size) ** 2
        gain[size < 0.05] = 0.0  # all but the same as those that are there
        known = float(residual @ residual - left @ left)
        for n in np.argsort(-gain)[: 4 * BEAM]:
            if gain[n] > 0:
                gains[tuple(sorted({*beam, int(n)}))] = known + float(gain[n])
    best: dict[tuple[str, ...], tuple[int, ...]] = {}
    for one in sorted(gains, key=lambda key: -gains[key]):
        best.setdefault(tuple(terms.placed[n].term.name for n in one), one)
    return list(best.values())[:BEAM]


def _sketched(chosen: tuple[int, ...], terms: Library, residual: Vector, judge: "_Judge", inflation: float) -> Sketched:
    picked = list(chosen)
    placed = tuple(terms.placed[n] for n in picked)
    apart = terms.own[picked] * terms.sizes[picked, None]
    return _weighed(placed, terms.columns[picked], apart, terms, residual, judge, inflation)


def _weighed(
    placed: tuple[Placed, ...],
    columns: Matrix,
    apart: Matrix,
    terms: Library,
    residual: Vector,
    judge: "_Judge",
    inflation: float,
) -> Sketched:
    """The law of these terms, by their whitened columns with and without what the model's parameters can do."""
    sizes = np.linalg.norm(apart, axis=1)
    own = apart / sizes[:, None]
    scaled, *_ = np.linalg.lstsq(own.T, residual, rcond=None)
    left = residual - scaled @ own
    before, after = float(residual @ residual), float(left @ left)
    independent = residual.size / inflation
    count = len(placed) + sum(bool(one.term.shape) for one in placed)
    price = count * np.log(independent) + 2 * len(placed) * np.log(len(terms.placed))
    delta = (after - before) / (after / residual.size) / inflation + price
    correlation = np.abs(own @ terms.own.T).max(axis=0)
    kinds = {one.term.name for one in placed}
    alike = {one.term.name for one, near in zip(terms.placed, correlation, strict=True) if near > ALIKE} - kinds
    return Sketched(
        placed, scaled / sizes, 1 - after / before, float(delta), judge.predicted(columns), tuple(sorted(alike))
    )


def _refined(
    law: Sketched,
    data: FitData,
    terms: Library,
    basis: Matrix,
    residual: Vector,
    judge: "_Judge",
    inflation: float,
) -> Sketched:
    """The law with its terms' own values moved, each in turn, as long as it takes more: the starts are far apart."""

    def apart(column: Vector) -> Vector:
        return np.asarray(column - basis @ (basis.T @ column))

    placed = list(law.placed)
    columns = np.array([_column(one, terms.scales, data) for one in placed])
    own = np.array([apart(one) for one in columns])
    best, factor = _power(own, residual), FIRST_MOVE
    for _ in range(MOVES):
        for n, move in product(range(len(placed)), (factor, 1 / factor)):
            if not placed[n].term.shape:
                continue
            moved = Placed(placed[n].term, placed[n].s * move)
            column = _column(moved, terms.scales, data)
            tried = own.copy()
            tried[n] = apart(column)
            if (power := _power(tried, residual)) > best:
                best, own, placed[n], columns[n] = power, tried, moved, column
        factor = float(np.sqrt(factor))
    return _weighed(tuple(placed), columns, own, terms, residual, judge, inflation)


def _power(apart: Matrix, residual: Vector) -> float:
    """Power of the residual that the columns explain."""
    size = np.linalg.norm(apart, axis=1)
    if not np.all(size > 0):
        return 0.0
    basis = linalg.orth((apart / size[:, None]).T)
    return float(np.sum((basis.T @ residual) ** 2))


@dataclass(frozen=True, slots=True, eq=False)
class _Judge:
    """Error of a law where neither it nor the model's parameters were fitted."""

    residual: Vector
    turned: Matrix
    """(p, m) of the model's parameters, of length 1."""
    spans: tuple[tuple[slice, float], ...]
    """Each part, with the factor from the weighed residual to noise ratios."""

    @classmethod
    def of(cls, data: FitData, fit: Fit, noise: Vector) -> "_Judge":
        turned = tangents(data, fit)
        size = np.linalg.norm(turned, axis=1)
        factors = [noise_rms(w) / floor for w, floor in zip(data.whitenings, noise, strict=True)]
        spans = list(zip(data.spans, factors, strict=True))
        if len({one.name for one in data.observations}) == 1:
            spans = [(part, factor) for span, factor in spans for part in _parts(span)]
        return cls(fit.residual, turned[size > 0] / size[size > 0, None], tuple(spans))

    @property
    def noise_ratio(self) -> float:
        """Root mean square over all records."""
        return float(np.sqrt(self._power(self.residual) / self.residual.size))

    def predicted(self, columns: Matrix) -> float:
        """Share of the excess error that terms take."""
        rows = np.concatenate([self.turned, columns / np.linalg.norm(columns, axis=1)[:, None]])
        without, after = (self._left(one) for one in (self.turned, rows))
        before = excess(without, min(1.0, without, after))
        return 1 - excess(after, min(1.0, without, after)) / before if before > 0 else 0.0

    def _power(self, residual: Vector) -> float:
        return float(sum(factor**2 * np.sum(residual[span] ** 2) for span, factor in self.spans))

    def _left(self, rows: Matrix) -> float:
        left = np.empty_like(self.residual)
        for span, _ in self.spans:
            others = np.ones(left.size, dtype=bool)
            others[span] = False
            weights, *_ = np.linalg.lstsq(rows[:, others].T, self.residual[others], rcond=1e-6)
            left[span] = self.residual[span] - weights @ rows[:, span]
        return float(np.sqrt(self._power(left) / left.size))


def _parts(span: slice) -> Iterator[slice]:
    """Bands of frequency, in which the coefficients of a whitened residual are ordered."""
    ends = np.linspace(span.start, span.stop, PARTS + 1).astype(int)
    for low, high in pairwise(ends):
        yield slice(int(low), int(high))
