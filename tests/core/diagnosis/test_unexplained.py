"""Noise holds no structure; a force that depends on the motion does, whether or not any effect has its form."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_observations import BOUC_WEN, RATE, observations

from core.arrays import Vector
from core.diagnosis.unexplained import delayed, explained_share
from core.fitting.data import FitData
from core.fitting.fit import at_values
from core.fitting.observation import Observation

NOISE = 0.02
SEEN = observations(BOUC_WEN, NOISE, 11, peaks=(0.02, 0.06))
NOTHING = 0.002
"""The share from which on a diagnosis calls it structure."""


def share(seen: tuple[Observation, ...]) -> float:
    data = FitData.by_noise(seen)
    return explained_share(data, at_values(data, BOUC_WEN))


def with_force(one: Observation, more: Vector) -> Observation:
    return replace(one, layer=replace(one.layer, force=one.layer.force + more))


@pytest.mark.parametrize("seed", range(4))
def test_noise_holds_none(seed: int) -> None:
    assert share(observations(BOUC_WEN, NOISE, seed, peaks=(0.02, 0.06))) < NOTHING


def test_the_share_grows_with_the_force_that_follows_the_motion() -> None:
    """A cubic force, which is among the regressors; most of it is what the model's own stiffness cannot do."""
    results = []
    for size in (0.5, 1.0, 4.0):
        cubic = [one.layer.displacement**3 for one in SEEN]
        scale = size * NOISE * np.sqrt(np.mean(SEEN[1].layer.force ** 2) / np.mean(cubic[1] ** 2))
        results.append(share(tuple(with_force(one, scale * more) for one, more in zip(SEEN, cubic, strict=True))))
    assert NOTHING < results[0] < results[1] < results[2]
    assert results[2] > 0.5


def test_what_the_models_own_parameters_can_do_is_no_structure() -> None:
    """A stiffness that is 3 % off is a refit: it is projected out of residual and regressors alike."""
    softer = tuple(with_force(one, 0.03 * 475e6 * one.layer.displacement) for one in SEEN)
    assert share(softer) < NOTHING


def test_a_delay_of_the_force_is_no_structure() -> None:
    """A delay of 1.5 ms, as between channels of different recorders."""
    late = tuple(with_force(one, -0.0015 * RATE * np.gradient(one.layer.force)) for one in SEEN)
    assert share(late) < NOTHING


def test_a_force_of_another_record_is_foretold_by_nothing() -> None:
    """As strong as the cubic one that is detected, and as low in frequency, but of another layer's motion."""
    others = observations(BOUC_WEN, NOISE, 12, peaks=(0.02, 0.06))
    strange = []
    for one, other in zip(SEEN, others, strict=True):
        cubic = other.layer.displacement**3
        scale = NOISE * np.sqrt(np.mean(one.layer.force**2) / np.mean(cubic**2))
        strange.append(with_force(one, scale * cubic))
    assert share(tuple(strange)) < NOTHING


def test_what_is_late_begins_as_the_record_does() -> None:
    """Not as it ends: a record may end far from where it began."""
    assert np.array_equal(delayed(np.array([1.0, 2.0, 3.0, 9.0]), 2), [1.0, 1.0, 1.0, 2.0])
    assert np.array_equal(delayed(np.array([1.0, 2.0]), 5), [1.0, 1.0])
