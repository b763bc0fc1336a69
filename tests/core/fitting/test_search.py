"""The slope of a search is the derivative of what it lowers, also where an amplitude is at the end of its range."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_observations import BOUC_WEN, observations

from core.fitting.data import FitData
from core.fitting.projection import free_parameters, is_clamped, projected, values_of
from core.fitting.search import start_search
from core.model.isolator import Isolator, Key

STEP = 1e-4
"""Step of a parameter's logarithm, to each side."""
DAMPING: Key = ("viscous", "c_b")


@pytest.mark.parametrize("fed", [0.0, 3e7])
def test_the_slope_is_the_derivative_of_the_misfit(fed: float) -> None:
    """N s/m of damping are removed from the measured force: so much that c_b goes to zero, or none."""
    seen = [
        replace(one, layer=replace(one.layer, force=one.layer.force - fed * one.layer.velocity))
        for one in observations(BOUC_WEN, 0.02, 3, peaks=(0.05,), seconds=20.0)
    ]
    data = FitData.by_noise(seen)
    yields = {**BOUC_WEN.effects["bouc_wen"], "D_y": 6e-3}
    model = Isolator({**BOUC_WEN.effects, "bouc_wen": yields})
    search, values = free_parameters(model), values_of(model)
    start = start_search(data, model)
    assert is_clamped(DAMPING, start.point.values) == (fed > 0)

    def cost(key: Key, change: float) -> float:
        return projected(data, search, {**values, key: values[key] * np.exp(change)}).cost

    keys = [search.nonlinear[row] for row in start.slope.free]
    assert ("bouc_wen", "D_y") in keys
    for key, descent in zip(keys, start.slope.quadratic.descent, strict=True):
        derivative = (cost(key, STEP) - cost(key, -STEP)) / (2 * STEP)
        assert -descent == pytest.approx(derivative, rel=1e-3, abs=1e-4 * start.point.cost)
