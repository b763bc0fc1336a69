from dataclasses import replace

import numpy as np
import pytest
from layer_observations import BAND, LATER, START, layer_observation

from core.comparison.compared import compare_forces, force_misfit
from core.comparison.misfit import pooled
from core.fitting.noise import force_noise
from core.model.isolator import Isolator
from core.paper import ISOLATOR


def changed(**stiffer: float) -> Isolator:
    return Isolator({**ISOLATOR.effects, "elastic": {"k_b": 475e6 * stiffer["by"]}})


def test_the_true_model_is_off_by_the_noise_alone() -> None:
    """Within 5 %: the noise's own scatter over 18000 samples is 0.5 %, its share beyond the band's edges 2 %."""
    (compared,) = compare_forces(ISOLATOR, [layer_observation(1)], BAND)
    noise = np.sqrt(np.mean(compared.observation.layer.force_std**2))
    assert compared.misfit.rms == pytest.approx(noise, rel=0.05)
    assert compared.misfit.fitting_rate > 98.5


def test_the_noise_counts_the_motions_uncertainty_too() -> None:
    seen = layer_observation(1)
    exact = replace(seen, layer=replace(seen.layer, displacement_std=None))
    both, force_alone = (force_noise(one) for one in (seen, exact))
    share = both.whitening.std.size / both.whitening.count
    assert both.rms**2 - force_alone.rms**2 == pytest.approx(share * (500e6 * 1e-5) ** 2, rel=0.2)  # about k_b dx


def test_a_softer_model_leaves_the_missing_stiffness_times_the_displacement() -> None:
    (compared,) = compare_forces(changed(by=0.8), [layer_observation(1)], BAND)
    x = compared.observation.layer.displacement
    assert np.polyfit(x, compared.residual, 1)[0] == pytest.approx(0.2 * 475e6, rel=0.02)  # of the noise


def test_earthquakes_are_compared_in_order_of_time() -> None:
    late, early = layer_observation(2, scale=0.5, start=START + LATER), layer_observation(1)
    compared = compare_forces(ISOLATOR, [late, early], BAND)
    assert [one.observation.start for one in compared] == [early.start, late.start]
    assert force_misfit(compared) == pooled([one.misfit for one in compared])


def test_what_the_layer_keeps_passes_to_the_next_earthquake() -> None:
    """Scragged rubber: the weak earthquake is stiffer before the strong one than after it."""
    scragged = Isolator({**ISOLATOR.effects, "mullins": {"k_M": 2e8, "u_M": 0.01}})
    weak = [layer_observation(1, scale=0.1, start=START + days * LATER) for days in (0, 2)]
    strong = layer_observation(1, scale=3.0, start=START + LATER)
    before, _, after = compare_forces(scragged, [*weak, strong], BAND)
    assert np.linalg.norm(before.model) > 1.1 * np.linalg.norm(after.model)
    assert not before.states.any()
    assert after.states.any()
