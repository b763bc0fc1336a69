"""A missing force over the variable that it depends on: what was measured, its mean with a deviation, and a law's."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from core.arrays import Mask, Vector
from core.comparison.compared import ForceComparison
from core.record import Direction
from core.sketching.dependence import BLOCK
from core.sketching.terms import LARGEST, TRAVELLED, Scales, Term, histories

DISPLACEMENT = "displacement"
AXES: Mapping[str, tuple[str, Term]] = MappingProxyType(
    {
        DISPLACEMENT: ("m", Term("", (), expression="u")),
        "velocity": ("m/s", Term("", (), expression="v")),
        "largest past displacement": ("m", Term("", (), memory=LARGEST, expression="largest")),
        "travel": ("m", Term("", (), memory=TRAVELLED, expression="travelled")),
        "axial load": ("1", Term("", (), expression="axial_load")),
        "temperature": ("°C", Term("", (), expression="temperature")),
        "other direction": ("m", Term("", (), expression="u_cross")),
    }
)
"""Variables that a picture can have as its axis, with their unit."""
BINS = 25
"""Parts of the axis. A choice."""
FEWEST = 10
"""Samples of a part at least. A choice."""


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """The missing force in one earthquake and direction."""

    earthquake: str
    direction: Direction
    variable: Vector
    """(n,) SI."""
    force: Vector
    """(n,) N: with a law, what the law and the rest of the residual are together."""
    law: Vector | None
    """(n,) N, the law's; None without one."""
    noise: float
    """N, root mean square."""
    velocity: Vector
    """(n,) m/s, of the layer."""
    block: Vector
    """(n,) number of the block of time."""


@dataclass(frozen=True, slots=True)
class Bin:
    """A part of the axis in one branch."""

    branch: int
    """1 and −1 for motion in the positive and the negative direction, 0 where both are one."""
    low: float
    high: float
    mean: float
    """N, of the missing force."""
    std: float
    """N, of the mean, by its scatter between blocks of time."""
    law: float | None
    """N, mean of the law."""


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """The missing force over one variable."""

    variable: str
    unit: str
    traces: tuple[Trace, ...]
    bins: tuple[Bin, ...]


def axis_of(variables: Sequence[str]) -> str:
    """The first of some variables that can be an axis; the displacement if there is none."""
    return next((one for one in variables if one in AXES), DISPLACEMENT)


def course(variable: str, scales: Scales, missing: Sequence[ForceComparison], laws: Sequence[Vector] = ()) -> Course:
    """The missing force over one variable.

    Args:
        variable: of AXES.
        scales: of the records.
        missing: residuals of a model, in order of time.
        laws: (n,) N of each, of a law that is part of this model; none without one.
    """
    unit, term = AXES[variable]
    values = histories(term, 0.0, scales, tuple(one.observation for one in missing))
    given: Sequence[Vector | None] = laws or [None] * len(missing)
    traces = tuple(_trace(one, value, law) for one, value, law in zip(missing, values, given, strict=True))
    return Course(variable, unit, traces, tuple(_bins(traces, has_branches=variable == DISPLACEMENT)))


def _trace(one: ForceComparison, variable: Vector, law: Vector | None) -> Trace:
    count, rate = one.resolved.size, one.observation.rate
    return Trace(
        one.observation.name,
        one.observation.direction,
        variable,
        one.resolved if law is None else one.resolved + law,
        law,
        one.noise.rms,
        one.observation.layer.velocity,
        np.arange(count) / rate // BLOCK,
    )


def _bins(traces: Sequence[Trace], *, has_branches: bool) -> Iterator[Bin]:
    """Means along the path: samples count by the speed; otherwise the quiet end of a record would outweigh all else."""
    x, force, velocity = (
        np.concatenate([getattr(one, of) for one in traces]) for of in ("variable", "force", "velocity")
    )
    noise = np.concatenate([np.full(one.force.size, one.noise) for one in traces])
    blocks = np.concatenate([number * 1e6 + one.block for number, one in enumerate(traces)])
    laws = None if traces[0].law is None else np.concatenate([one.law for one in traces if one.law is not None])
    edges = np.linspace(x.min(), x.max(), BINS + 1)
    part = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, BINS - 1)
    weight = np.abs(velocity)
    for branch in (1, -1) if has_branches else (0,):
        moving: Mask = velocity * branch > 0 if branch else weight > 0
        for number, (low, high) in enumerate(pairwise(edges.tolist())):
            within = moving & (part == number)
            if within.sum() >= FEWEST:
                share = weight[within] / weight[within].sum()
                yield Bin(
                    branch,
                    low,
                    high,
                    float(share @ force[within]),
                    _deviation(force[within], share, noise[within], blocks[within]),
                    None if laws is None else float(share @ laws[within]),
                )


def _deviation(force: Vector, share: Vector, noise: Vector, blocks: Vector) -> float:
    """N, of the mean, as if samples of one block were one; noise alone gives it where there is one block only."""
    _, of = np.unique(blocks, return_inverse=True)
    count = int(of.max()) + 1
    if count < 2:
        return float(np.sqrt(share @ noise**2))
    sums = np.bincount(of, share * (force - share @ force))
    return float(np.sqrt(np.sum(sums**2) * count / (count - 1)))
