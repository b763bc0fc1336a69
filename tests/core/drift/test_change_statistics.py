"""Likelihood ratios and sizes of changes against their closed forms."""

import numpy as np
import pytest

from core.drift.change_statistics import change_size, innovations, signed_roots
from core.drift.rules import ramps, steps

KNOWN = 1e9
"""Degrees of freedom of a scale that is practically known."""


def test_patterns() -> None:
    assert steps(3).tolist() == [[1, 0, 0], [1, 1, 0], [1, 1, 1]]
    assert ramps(3).tolist() == [[1, 0, 0], [2, 1, 0], [3, 2, 1]]


def test_independent_deviations_of_known_scale_give_the_gaussian_ratio() -> None:
    """A step of n events: |Σz| / √n (Basseville and Nikiforov, 1993, eq. 2.4.40)."""
    deviation = np.array([0.3, -0.5, -2.0, -1.8, -2.2])
    root, supporting = signed_roots(innovations(deviation, np.eye(5), KNOWN, 10.0), steps(5), -1)
    for onset in range(1, 5):
        expected = max(0.0, -deviation[onset:].sum()) / np.sqrt(5 - onset)
        assert root[4, onset] == pytest.approx(expected, abs=1e-4)
    assert supporting[4].tolist() == [3, 3, 3, 2, 1]
    assert (root[:2, 2:] == 0).all(), "events before the onset do not support a change"


def test_a_rise_is_not_a_fall() -> None:
    white = innovations(np.full(6, 2.0), np.eye(6), KNOWN, 10.0)
    assert signed_roots(white, steps(6), -1)[0].max() == 0.0
    assert signed_roots(white, steps(6), 1)[0].max() == pytest.approx(2 * np.sqrt(6), abs=1e-4)


def test_a_shared_error_is_not_mistaken_for_many_independent_ones() -> None:
    """With a common variance c the sum of n deviations has variance n + n²c."""
    n, c = 40, 0.25
    white = innovations(np.full(n, -1.0), np.eye(n) + c, KNOWN, 10.0)
    root, _ = signed_roots(white, steps(n), -1)
    assert root[-1, 0] == pytest.approx(n / np.sqrt(n + c * n**2), rel=1e-6)


def test_an_uncertain_scale_weakens_the_evidence() -> None:
    deviation = np.array([-3.0, -3.0])
    strong, weak = (
        signed_roots(innovations(deviation, np.eye(2), ν, 10.0), steps(2), -1)[0][1, 0] for ν in (KNOWN, 10.0)
    )
    assert strong == pytest.approx(np.sqrt(18), abs=1e-4)
    assert weak == pytest.approx(np.sqrt(12 * np.log(28 / 10)))


def test_a_clipped_event_does_not_mislead_the_next() -> None:
    covariance = np.eye(3) + 0.5
    clipped = innovations(np.array([0.0, -100.0, 0.0]), covariance, KNOWN, 4.0)
    assert clipped.clipped[1] == -4.0
    assert abs(clipped.clipped[2]) < 2.0
    assert abs(clipped.raw[2]) > 10.0


def test_a_change_is_estimated_by_generalised_least_squares() -> None:
    rng = np.random.default_rng(4)
    root = rng.standard_normal((8, 8))
    covariance, pattern = root @ root.T + np.eye(8), steps(8)[:, 3]
    deviation = rng.standard_normal(8) - 0.5 * pattern
    size = change_size(innovations(deviation, covariance, 30.0, 4.0), pattern)
    inverse = np.linalg.inv(covariance)
    assert size.size == pytest.approx((pattern @ inverse @ deviation) / (pattern @ inverse @ pattern))
    assert size.high - size.size == pytest.approx(size.size - size.low)
