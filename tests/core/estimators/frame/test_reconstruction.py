"""The common part of all sensors' gains and delays is no sensor's error: it stays in the motion and in the force."""

from dataclasses import replace

import numpy as np
import pytest
from exact_spectra import BANDS, DESIGN, RATE

from core.estimators.frame.calibration import Calibration, first_variances
from core.estimators.frame.evaluation import Problem, evaluated
from core.estimators.frame.hypotheses import corrected
from core.estimators.frame.lines import Lines
from core.estimators.frame.model import superstructure
from core.estimators.frame.uncertainty import MOVING, reconstructed
from core.paper import BUILDING

LAYOUT = DESIGN.layout
SAMPLES = 1501
"""Odd: the spectrum has no line that is real whatever its delay."""
GAIN, LATE = 1.3, 0.04
"""Gain and delay (s) of all channels."""


def cut(seed: int) -> Lines:
    """All lines of a record that neither begins nor ends at rest."""
    spectra = np.fft.rfft(np.random.default_rng(seed).standard_normal((LAYOUT.channels, SAMPLES)), axis=1)
    frequency = np.fft.rfftfreq(SAMPLES, 1 / RATE)
    angular = np.asarray(2 * np.pi * np.maximum(frequency, 1e-3 * frequency[1]), dtype=float)
    noise, colour = np.array([10.0, 20.0, 30.0]), np.ones(angular.size)
    return Lines(angular, spectra, noise, colour, np.digitize(frequency, BANDS), SAMPLES, RATE, False)


def calibration(lines: Lines, seed: int) -> Calibration:
    """Some parameters, free vibration among them; what sensors have in common is nothing."""
    rng, hypothesis = np.random.default_rng([seed, 1]), corrected(DESIGN, 1.0)
    parameters = hypothesis.mean + 0.1 * hypothesis.std * rng.standard_normal(LAYOUT.size)
    parameters[LAYOUT.scale] = 0.0
    parameters[LAYOUT.transients] = 3000.0 * rng.standard_normal(2 * LAYOUT.floors)
    for which in (LAYOUT.gains, LAYOUT.delays):
        parameters[which] -= np.median(parameters[which])
    problem = Problem(lines, DESIGN, hypothesis)
    here = evaluated(problem, parameters, first_variances(problem))
    return Calibration(
        hypothesis=hypothesis,
        parameters=parameters,
        structure=here.structure,
        variances=here.variances,
        covariance=np.diag((1e-3 * hypothesis.std) ** 2),
        misfit_by_band=here.misfit_by_band,
        degrees_of_freedom=here.degrees_of_freedom,
        lines=lines.angular.size,
        noise=lines.noise,
        has_settled=True,
    )


def test_force_and_free_vibration_bear_what_all_channels_have_in_common() -> None:
    """All channels of another gain, and late: the force is as much larger, and as late; but for rounding."""
    lines = cut(5)
    choice = calibration(lines, 5)
    common = GAIN * np.exp(-1j * LATE * lines.angular)
    moved = replace(lines, spectra=common * lines.spectra, noise=GAIN**2 * lines.noise)
    parameters = choice.parameters.copy()
    parameters[LAYOUT.gains] += np.log(GAIN)
    parameters[LAYOUT.delays] += LATE
    reported = reconstructed(lines, DESIGN, choice, BUILDING.base_mass).force
    late = reconstructed(moved, DESIGN, replace(choice, parameters=parameters), BUILDING.base_mass).force
    expected = np.fft.irfft(common * np.fft.rfft(reported), SAMPLES)
    assert late == pytest.approx(expected, abs=1e-9 * np.abs(reported).max())


def test_free_vibration_has_a_part_in_that_force() -> None:
    lines = cut(5)
    choice = calibration(lines, 5)
    without = choice.parameters.copy()
    without[LAYOUT.transients] = 0.0
    with_it, at_rest = (
        reconstructed(lines, DESIGN, replace(choice, parameters=one), BUILDING.base_mass).force
        for one in (choice.parameters, without)
    )
    assert np.abs(with_it - at_rest).max() > 0.1 * np.abs(at_rest).max()


def test_the_effect_of_an_uncertain_parameter_does_not_depend_on_the_sign_of_its_direction() -> None:
    """Half the difference of the forces one standard deviation above and below, below 15 Hz; 30 % is no small move."""
    lines, uncertain = cut(7), 0.3 * (np.arange(LAYOUT.size) == LAYOUT.scale)
    choice = replace(calibration(lines, 7), covariance=np.diag(uncertain**2))
    above, below = (
        reconstructed(
            lines, DESIGN, replace(choice, parameters=at, structure=superstructure(at, DESIGN)), BUILDING.base_mass
        ).force
        for at in (choice.parameters + uncertain, choice.parameters - uncertain)
    )
    expected = np.fft.rfft(above - below) / 2 * (lines.angular < 2 * np.pi * MOVING)
    expected = np.sqrt(max(1.0, choice.chi_square)) * np.fft.irfft(expected, SAMPLES)
    pattern, _ = reconstructed(lines, DESIGN, choice, BUILDING.base_mass).systematic
    off = min(np.linalg.norm(pattern - expected), np.linalg.norm(pattern + expected))
    assert off < 1e-3 * np.linalg.norm(expected)  # the base slab's power is averaged over neighbours of the last line
