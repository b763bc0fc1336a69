"""The Maxwell element's storage and loss modulus."""

import numpy as np
import pytest
from excitations import TURN, equal_cycles, layer_force


def test_harmonic_force_is_by_storage_and_loss_modulus() -> None:
    """K' = K (ωτ)² / (1 + (ωτ)²), K'' = K ωτ / (1 + (ωτ)²); 1e-3: straight lines between samples."""
    given, K, tau = equal_cycles(400.0, count=20, amplitude=0.1), 3e7, 0.3
    force = layer_force({"maxwell": {"K": K, "tau": tau}}, given)
    last = slice(-given.velocity.size // 20, None)
    wave = np.column_stack([given.displacement, given.velocity / TURN])[last]
    storage, loss = np.linalg.lstsq(wave, force[last], rcond=None)[0]
    turn = TURN * tau
    assert storage == pytest.approx(K * turn**2 / (1 + turn**2), rel=1e-3)
    assert loss == pytest.approx(K * turn / (1 + turn**2), rel=1e-3)
