"""The inerter in the simulated building: a longer period, by its mass."""

import numpy as np
import pytest

from core.building import ShearBuilding
from core.model.isolator import Isolator
from core.model.simulation import simulate


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_the_period_grows_with_the_root_of_the_mass_ratio(share: float) -> None:
    """A stiff building of mass M on k_b: T = 2π sqrt((M + b) / k_b). 3e-3: its storey is stiff, not rigid."""
    mass, stiffness, rate = 2e6, 4e7, 100.0
    building = ShearBuilding(mass / 2, np.array([mass / 2]), np.array([1e4 * stiffness]), 1e-5)
    layer = Isolator({"elastic": {"k_b": stiffness}, "inerter": {"apparent_mass": share * mass}})
    blow = np.where(np.arange(2000) < 5, 1.0, 0.0)
    swing = simulate(building, layer, blow, rate).isolator_displacement[100:]
    upward = np.flatnonzero((swing[:-1] < 0) & (swing[1:] >= 0))
    crossing = upward - swing[upward] / (swing[upward + 1] - swing[upward])
    period = np.diff(crossing).mean() / rate
    assert period == pytest.approx(2 * np.pi * np.sqrt((1 + share) * mass / stiffness), rel=3e-3)
