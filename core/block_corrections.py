"""Which correction of a model does each block of the records ask for, by itself?"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.arrays import Matrix, Vector
from core.comparison import ForceComparison
from core.driven import driven
from core.effects import EFFECTS
from core.equivalent import amplitude, regression, windows
from core.excess import BLOCK
from core.isolator import Isolator, Key

TOLD = 0.25
"""Of the block's own stiffness: a correction of larger standard deviation tells nothing."""


@dataclass(frozen=True, slots=True)
class BlockCorrection:
    """What one block would have the model change."""

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
    """N, to be added to the model's; None of a model without hysteresis."""
    yield_std: float | None


def block_corrections(isolator: Isolator, compared: Sequence[ForceComparison]) -> tuple[BlockCorrection, ...]:
    """Of every block of BLOCK seconds that determines its stiffness.

    The residual's regression on displacement and velocity gives the stiffness; together with the model's own hysteretic
    variable it gives the yield force.

    Args:
        isolator: the model.
        compared: its force against what was estimated, in order of time.
    """
    found: list[BlockCorrection] = []
    travelled: dict[str, float] = {}
    for one in compared:
        direction = one.observation.direction
        found += _of_one(isolator, one, travelled.get(direction, 0.0))
        path = float(np.abs(one.observation.layer.velocity).sum()) / one.observation.rate
        travelled[direction] = travelled.get(direction, 0.0) + path
    return tuple(found)


def _of_one(isolator: Isolator, one: ForceComparison, travelled: float) -> list[BlockCorrection]:
    layer, rate = one.observation.layer, one.observation.rate
    motion, yielding = np.column_stack([layer.displacement, layer.velocity]), _yielding(isolator, one)
    travel = travelled + np.cumsum(np.abs(layer.velocity)) / rate
    found = []
    for start, end in windows(layer.displacement.size, rate, BLOCK):
        own, _ = _slopes(motion[start:end], layer.force[start:end])
        soft, soft_std = _slopes(motion[start:end], one.residual[start:end])
        if not soft_std[0] < TOLD * abs(own[0]):
            continue
        late = None if yielding is None else np.column_stack([motion, yielding])[start:end]
        force, force_std = (
            (None, None) if late is None else (float(s[2]) for s in _slopes(late, one.residual[start:end]))
        )
        found.append(
            BlockCorrection(
                earthquake=one.observation.name,
                direction=one.observation.direction,
                start=start / rate,
                amplitude=amplitude(layer.displacement[start:end]),
                travel=float(travel[(start + end) // 2]),
                stiffness=float(soft[0]),
                stiffness_std=float(soft_std[0]),
                yield_force=force,
                yield_std=force_std,
            )
        )
    return found


def _slopes(regressors: Matrix, response: Vector) -> tuple[Vector, Vector]:
    """(p,) coefficients and their standard deviations, beside an intercept."""
    scale = np.maximum(regressors.std(axis=0), np.finfo(float).tiny)
    columns = np.column_stack([regressors / scale, np.ones(response.size)])
    coefficients, covariance = regression(columns, response)
    return coefficients[:-1] / scale, np.sqrt(np.diag(covariance))[:-1] / scale


def _yielding(isolator: Isolator, one: ForceComparison) -> Vector | None:
    """(n,) the model's force per unit of its yield force; None of one without hysteresis."""
    layer, key = one.observation.layer, _yield_force(isolator)
    if key is None:
        return None
    answer = driven(
        isolator,
        layer.displacement,
        layer.velocity,
        one.observation.rate,
        conditions=one.observation.conditions,
        states=one.states,
        wanted=[key],
    )
    return np.asarray(answer.by_parameter[0])


def _yield_force(isolator: Isolator) -> Key | None:
    """What the force of the effect that publishes its hysteretic variable is proportional to."""
    publishing = [name for name in isolator.effects if EFFECTS[name].publishes is not None]
    return (publishing[0], EFFECTS[publishing[0]].linear[0]) if publishing and EFFECTS[publishing[0]].linear else None
