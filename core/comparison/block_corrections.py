"""Corrections of a model's stiffness and yield force, determined by each block of the records alone."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.arrays import Matrix, Vector
from core.comparison.compared import ForceComparison
from core.comparison.excess import BLOCK
from core.effects import EFFECTS
from core.isolation_layer.equivalent import amplitude, windows
from core.model.force_response import force_response
from core.model.isolator import Isolator, Key
from core.signals.regression import regression

LARGEST_STD = 0.25
"""Largest useful standard deviation of a correction, as a share of the block's own stiffness or yield force. A
choice."""
YIELDING = 0.7
"""Share of the hysteretic variable's ultimate value that a block must reach to separate yield force and stiffness. A
choice."""


@dataclass(frozen=True, slots=True)
class BlockCorrection:
    """Corrections of a model by one block."""

    earthquake: str
    direction: str
    start: float
    """s after the record's start."""
    amplitude: float
    """m, √2 · RMS of the displacement."""
    travel: float
    """m, that the layer had moved in all earthquakes until the middle of the block."""
    stiffness: float
    """N/m, to be added to the model's."""
    stiffness_std: float
    yield_force: float | None
    """N, to be added to the model's; None for a model without hysteresis, or if the block does not determine it."""
    yield_std: float | None


def block_corrections(isolator: Isolator, compared: Sequence[ForceComparison]) -> tuple[BlockCorrection, ...]:
    """Corrections of every block of BLOCK seconds that determines its stiffness.

    The residual's regression on displacement and velocity gives the stiffness; together with the model's own hysteretic
    variable it gives the yield force.

    Args:
        isolator: the model.
        compared: its force against what was estimated, in order of time.
    """
    corrections: list[BlockCorrection] = []
    travelled: dict[str, float] = {}
    for one in compared:
        direction = one.observation.direction
        corrections += _of_one(isolator, one, travelled.get(direction, 0.0))
        path = float(np.abs(one.observation.layer.velocity).sum()) / one.observation.rate
        travelled[direction] = travelled.get(direction, 0.0) + path
    return tuple(corrections)


def _of_one(isolator: Isolator, one: ForceComparison, travelled: float) -> list[BlockCorrection]:
    layer, rate = one.observation.layer, one.observation.rate
    motion, hysteresis = np.column_stack([layer.displacement, layer.velocity]), _hysteresis(isolator, one)
    travel = travelled + np.cumsum(np.abs(layer.velocity)) / rate
    corrections = []
    for start, end in windows(layer.displacement.size, rate, BLOCK):
        own, _ = _slopes(motion[start:end], layer.force[start:end])
        soft, soft_std = _slopes(motion[start:end], one.residual[start:end])
        if not soft_std[0] < LARGEST_STD * abs(own[0]):
            continue
        yielding = None if hysteresis is None else _yield_correction(hysteresis, motion, one, slice(start, end))
        corrections.append(
            BlockCorrection(
                earthquake=one.observation.name,
                direction=one.observation.direction,
                start=start / rate,
                amplitude=amplitude(layer.displacement[start:end]),
                travel=float(travel[(start + end) // 2]),
                stiffness=float(soft[0]),
                stiffness_std=float(soft_std[0]),
                yield_force=yielding and yielding[0],
                yield_std=yielding and yielding[1],
            )
        )
    return corrections


def _slopes(regressors: Matrix, response: Vector) -> tuple[Vector, Vector]:
    """(p,) coefficients and their standard deviations, beside an intercept."""
    scale = np.maximum(regressors.std(axis=0), np.finfo(float).tiny)
    columns = np.column_stack([regressors / scale, np.ones(response.size)])
    coefficients, covariance = regression(columns, response)
    return coefficients[:-1] / scale, np.sqrt(np.diag(covariance))[:-1] / scale


@dataclass(frozen=True, slots=True, eq=False)
class _Hysteresis:
    """The model's hysteresis in one earthquake."""

    yield_force: float
    """N."""
    variable: Vector
    """(n,) its force per unit of the yield force."""


def _hysteresis(isolator: Isolator, one: ForceComparison) -> _Hysteresis | None:
    """None of a model without."""
    layer, key = one.observation.layer, _yield_force(isolator)
    if key is None:
        return None
    answer = force_response(
        isolator,
        layer.displacement,
        layer.velocity,
        one.observation.rate,
        conditions=one.observation.conditions,
        states=one.states,
        wanted=[key],
    )
    return _Hysteresis(isolator.effects[key[0]][key[1]], np.asarray(answer.by_parameter[0]))


def _yield_correction(
    hysteresis: _Hysteresis, motion: Matrix, one: ForceComparison, block: slice
) -> tuple[float, float] | None:
    """N and its standard deviation; None where the block does not determine it."""
    variable = hysteresis.variable[block]
    if np.abs(variable).max() < YIELDING:
        return None
    change, std = (float(s[2]) for s in _slopes(np.column_stack([motion[block], variable]), one.residual[block]))
    return (change, std) if std < LARGEST_STD * abs(hysteresis.yield_force + change) else None


def _yield_force(isolator: Isolator) -> Key | None:
    """Parameter that the force of the effect with the hysteretic variable is proportional to."""
    publishing = [name for name in isolator.effects if EFFECTS[name].publishes is not None]
    return (publishing[0], EFFECTS[publishing[0]].linear[0]) if publishing and EFFECTS[publishing[0]].linear else None
