"""The paper's figures 10-16 on recorded motions: published fitting rates of the reference prototype, at its digits.

The paper's own record (Hiyoshi, 2005) is not to be had; the reference values are for AKT013, Kobe and Chi-Chi.
"""

from collections.abc import Callable
from dataclasses import replace

import ground_motions
import numpy as np
import pytest

from core.arrays import Vector
from core.building import fixed_base_modes as analytic_modes
from core.comparison.misfit import fitting_rate as fit
from core.estimators.cms import at_all_floors, estimate, fixed_base_modes, force_of_shapes, shape_matrix
from core.estimators.substructure import modal_acceleration
from core.estimators.superstructure import InstrumentedSuperstructure
from core.identification.identified_modes import Identification, identified_modes
from core.identification.modes import Mode, mass_normalised
from core.identification.refinement import Refinement
from core.model.simulation import Response, simulate
from core.paper import BUILDING, ISOLATOR

MEASURED = np.array([2, 6])  # fourth storey and roof
POINTS = 0.3  # what the project asks for, of the reference's one decimal

records = pytest.mark.parametrize(
    ("motion", "force", "first", "second", "one_mode"),
    [
        (ground_motions.akt013, (97.1, 97.1, 93.3), (93.8, 81.2), (88.9, 64.3), 91.0),
        (ground_motions.kobe, (93.5, 93.5, 90.0), (93.8, 87.8), (89.6, 80.1), 78.9),
        (ground_motions.chi_chi, (98.0, 97.9, 93.6), (95.3, 82.7), (87.5, 52.7), 93.6),
    ],
    ids=["akt013", "kobe", "chi_chi"],
)


def response(motion: Callable[[], Vector]) -> Response:
    return simulate(BUILDING, ISOLATOR, motion(), ground_motions.RATE)


def measured(truth: Response, noise: float, seed: int) -> InstrumentedSuperstructure:
    rng = np.random.default_rng(seed)
    clean = np.vstack([truth.base_acceleration, truth.floor_acceleration[MEASURED]])
    rms = np.sqrt(np.mean(clean**2, axis=1, keepdims=True))
    noisy = clean + noise * rms * rng.standard_normal(clean.shape)
    return InstrumentedSuperstructure(
        ground_motions.RATE, noisy[0], noisy[1:], MEASURED, BUILDING.base_mass, BUILDING.floor_mass
    )


def subspace_modes(record: InstrumentedSuperstructure) -> tuple[Mode, ...]:
    """The paper's: noise of the input is not allowed for."""
    series = record.base_acceleration, record.floor_acceleration, record.rate
    return at_all_floors(Refinement(identified_modes(*series, Identification()), misfit=1.0), record)


@pytest.mark.accuracy
@records
def test_fit_of_the_force(motion, force, first, second, one_mode) -> None:  # noqa: ANN001
    truth = response(motion)
    fits = [fit(truth.force, estimate(measured(truth, noise, seed=1)).force) for noise in (0.0, 0.01, 0.1)]
    assert fits == pytest.approx(force, abs=POINTS)


@records
def test_fit_of_the_modal_accelerations(motion, force, first, second, one_mode) -> None:  # noqa: ANN001
    """Mass-normalised, so that the expanded shape's modal mass counts. Signs follow the roof's."""
    truth = response(motion)
    exact = analytic_modes(BUILDING).shape
    exact = exact * np.sign(exact[-1])
    modal = np.linalg.solve(exact, truth.floor_acceleration - truth.base_acceleration)
    for level, noise in enumerate((0.01, 0.1)):
        record = measured(truth, noise, seed=1)
        shapes = mass_normalised(shape_matrix(subspace_modes(record)[:2], 7), BUILDING.floor_mass)
        result = modal_acceleration(shapes, MEASURED, record.floor_acceleration - record.base_acceleration)
        assert fit(modal[0], result[0]) == pytest.approx(first[level], abs=POINTS)
        # Ten percent of noise in the second mode's shape moves this by half a point from one draw to the next.
        assert fit(modal[1], result[1]) == pytest.approx(second[level], abs=POINTS if noise < 0.1 else 1.0)


@records
def test_fit_with_one_mode_only(motion, force, first, second, one_mode) -> None:  # noqa: ANN001
    truth = response(motion)
    record = measured(truth, 0.01, seed=1)
    modes = fixed_base_modes(record, Identification())[:1]
    assert fit(truth.force, force_of_shapes(record, shape_matrix(modes, 7), modes).force) == pytest.approx(
        one_mode, abs=POINTS
    )


def test_a_tenth_too_little_mass_scales_the_force() -> None:
    """Figure 15; 89.1 and, the total corrected, 97.1."""
    truth = response(ground_motions.akt013)
    record = measured(truth, 0.01, seed=1)
    light = replace(record, base_mass=0.9 * record.base_mass, floor_mass=0.9 * record.floor_mass)
    force = estimate(light).force
    assert fit(truth.force, force) == pytest.approx(89.1, abs=POINTS)
    assert fit(truth.force, force / 0.9) == pytest.approx(97.1, abs=POINTS)


@pytest.mark.accuracy
def test_scattered_masses_matter_through_their_total() -> None:
    """Figure 16 over 200 draws of 20 % scatter: mean 92.3, sd 3.9; the total corrected, 95.8."""
    rng = np.random.default_rng(16)
    truth = response(ground_motions.akt013)
    record = measured(truth, 0.01, seed=1)
    modes = fixed_base_modes(record, Identification())
    total = BUILDING.base_mass + BUILDING.floor_mass.sum()
    as_drawn, corrected = [], []
    for _ in range(200):
        masses = np.append(BUILDING.base_mass, BUILDING.floor_mass) * (1 + 0.2 * rng.standard_normal(8))
        drawn = replace(record, base_mass=masses[0], floor_mass=masses[1:])
        force = force_of_shapes(drawn, shape_matrix(modes, 7), modes).force
        as_drawn.append(fit(truth.force, force))
        corrected.append(fit(truth.force, force * total / masses.sum()))
    assert np.mean(as_drawn) == pytest.approx(92.3, abs=3 * 3.9 / np.sqrt(200))  # three standard errors of the mean
    assert np.mean(corrected) == pytest.approx(95.8, abs=3 * 3.9 / np.sqrt(200))


@pytest.mark.parametrize("motion", [ground_motions.akt013, ground_motions.kobe, ground_motions.chi_chi])
def test_modes_at_one_percent_of_noise(motion: Callable[[], Vector]) -> None:
    """The project's goal: frequencies within 0.2 %, damping ratios within 5 % of the truth, noise on all channels."""
    truth, exact = response(motion), analytic_modes(BUILDING)
    for seed in range(5):
        modes = fixed_base_modes(measured(truth, 0.01, seed), Identification())[:2]
        assert [mode.frequency for mode in modes] == pytest.approx(exact.frequency[:2], rel=0.002)
        assert [mode.damping_ratio for mode in modes] == pytest.approx(exact.damping_ratio[:2], rel=0.05)
        assert modes[0].shape[2] == pytest.approx(0.4419, rel=0.02)  # Table III at 1 % noise
        assert modes[1].shape[2] == pytest.approx(-1.0053, rel=0.02)
