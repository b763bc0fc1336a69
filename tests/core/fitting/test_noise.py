"""One noise ratio of a model in its records, wherever it is shown; about 1 for a right model."""

import gc
from dataclasses import replace
from weakref import ref

import numpy as np
import pytest
from layer_observations import BAND, LATER, START, layer_observation
from synthetic_observations import BOUC_WEN, RATE, observations

from core import workbench
from core.comparison.compared import compare_forces, force_misfit
from core.fitting.data import FitData
from core.fitting.fit import at_values, chi_square, rms_by_record, weighted_fit
from core.fitting.noise import force_noise, pooled_rms
from core.model.isolator import Isolator
from core.paper import ISOLATOR

HARD = Isolator({**BOUC_WEN.effects, "hardening": {"k3": 2e10, "k5": 0.0}})


def test_a_right_model_has_a_ratio_of_one() -> None:
    """Over 8 seeds it lies between 0.95 and 1."""
    for seed in range(3):
        (compared,) = compare_forces(ISOLATOR, [layer_observation(seed)], BAND)
        assert compared.misfit.noise_ratio == pytest.approx(1.0, abs=0.06)


def test_a_delay_between_force_and_motion_is_noise() -> None:
    """A delay of 0.8 ms, four deviations, changes the force by 0.4 %; its noise is 0.2 %. Without it: 0.99 to 1.02."""
    for seed in range(3):
        seen = observations(BOUC_WEN, 0.002, seed)
        late = [
            replace(one.layer, force=one.layer.force - 0.0008 * RATE * np.gradient(one.layer.force)) for one in seen
        ]
        data = FitData.by_noise([replace(one, layer=layer) for one, layer in zip(seen, late, strict=True)])
        assert np.sqrt(chi_square(data, BOUC_WEN) / data.target.size) == pytest.approx(1.0, abs=0.05)


def test_a_possible_delay_is_no_excuse_for_the_damping_of_a_wrong_model() -> None:
    """A linear model of a layer that yields: at most 2 % more error than the regression on displacement and velocity
    leaves."""
    (seen,) = observations(BOUC_WEN, 0.002, 1)[:1]
    linear = Isolator({"elastic": {"k_b": 1e8}, "viscous": {"c_b": 1e6}})
    weighted = weighted_fit([seen], linear)
    (weights,), layer = weighted.data.whitenings, seen.layer
    motion = weights.filtered(np.array([layer.displacement, layer.velocity])).T
    force = weights.coefficients(layer.force[None])[0]
    least = np.linalg.norm(force - motion @ np.linalg.lstsq(motion, force)[0])
    effects = weighted.fit.model.effects
    model = motion @ np.array([effects["elastic"]["k_b"], effects["viscous"]["c_b"]])
    assert np.linalg.norm(force - model) < 1.02 * least


def test_the_noise_of_the_samples_is_that_of_the_frequencies() -> None:
    """Noise that grows during the record is included."""
    one = layer_observation(1)
    growing = one.layer.force_std * np.linspace(1.0, 3.0, one.layer.force.size)
    noise = force_noise(replace(one, layer=replace(one.layer, force_std=growing)))
    assert np.sqrt(np.mean(noise.std**2)) == pytest.approx(noise.rms)


def test_the_noise_of_an_observation_is_computed_once_and_goes_with_it() -> None:
    one = replace(layer_observation(1))
    louder = replace(one, layer=replace(one.layer, force_std=2 * one.layer.force_std))
    noise, seen = force_noise(one), ref(one)
    assert force_noise(one) is noise
    assert force_noise(louder).rms > 1.5 * noise.rms
    del one
    gc.collect()
    assert seen() is None


def test_a_comparison_and_a_fit_measure_one_residual() -> None:
    """A model without nonlinear parameters, at the values that it was fitted to."""
    seen = [layer_observation(1), layer_observation(2, scale=0.5, start=START + LATER)]
    data = FitData.by_noise(seen)
    fit = at_values(data, Isolator({"elastic": {"k_b": 475e6}}))
    noise = np.array([force_noise(one).rms for one in seen])
    counts = np.array([one.layer.force.size for one in seen])
    expected = pooled_rms(rms_by_record(data, fit.residual) / noise, counts)
    assert force_misfit(compare_forces(fit.model, seen, BAND)).noise_ratio == pytest.approx(expected, rel=1e-9)


def test_fit_comparison_and_diagnosis_show_one_ratio() -> None:
    """To the six digits to which a model's values are rounded."""
    seen = observations(HARD, 0.02, 3, peaks=(0.02, 0.06))
    fitted = workbench.fit(BOUC_WEN, seen)
    compared = workbench.compare(fitted.model, seen)
    diagnosed = workbench.diagnose(fitted.model, seen, effects=("hardening",))
    ratio = compared.errors.noise_ratio
    assert compared.failure.noise_ratio.value == pytest.approx(ratio, rel=1e-9)
    assert fitted.versions[-1].errors.noise_ratio == pytest.approx(ratio, rel=1e-9)
    assert diagnosed.versions[0].errors.noise_ratio == pytest.approx(ratio, rel=1e-9)
    without = diagnosed.diagnosis.first
    assert without.noise_ratio(without.base) == pytest.approx(diagnosed.versions[1].errors.noise_ratio, rel=1e-3)
    (candidate,) = diagnosed.candidates
    after = workbench.compare(candidate.fit.model, seen)
    assert candidate.noise_ratio == pytest.approx(after.failure.noise_ratio.value, rel=1e-6)
    assert candidate.noise_ratio == pytest.approx(1.0, abs=0.1)
