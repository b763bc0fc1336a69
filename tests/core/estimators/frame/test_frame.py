import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from core.arrays import Matrix, Vector
from core.building import storey_stiffness_matrix
from core.estimators.frame.frame import heights, lateral_stiffness

STEP = 1e-5
"""Of a logarithm: central differences are then right to 1e-9 by their truncation and by rounding alike."""

storeys = st.lists(st.floats(0.2, 5.0), min_size=1, max_size=8).map(np.array)
joints = st.floats(0.01, 20.0)
rocking = st.floats(0.0, 2.0)
bending = st.floats(0.0, 2.0)


def cantilever_flexibility(storey_stiffness: Vector) -> Matrix:
    """(floors, floors) of a beam clamped at its foot, by the unit-load method (Castigliano): ∫ (x_i - x)(x_j - x) / EI.

    A storey of height 1 with both ends clamped has the stiffness 12 EI.
    """
    floors = np.arange(1, storey_stiffness.size + 1)

    def moments(low: int, high: int, storey: int) -> float:
        # the integral over [storey - 1, storey] of a product that is quadratic: Simpson's rule is exact
        x = np.array([storey - 1.0, storey - 0.5, float(storey)])
        return float(np.array([1, 4, 1]) / 6 @ ((low - x) * (high - x)))

    return np.array(
        [
            [12 * sum(moments(i, j, s) / storey_stiffness[s - 1] for s in range(1, min(i, j) + 1)) for j in floors]
            for i in floors
        ]
    )


@settings(max_examples=30, deadline=None)
@given(storeys=storeys)
def test_rigid_joints_make_it_the_shear_building(storeys: Vector) -> None:
    exact = storey_stiffness_matrix(storeys)
    found = lateral_stiffness(storeys, joints=0.0, rocking=0.0, bending=0.0).stiffness
    assert found == pytest.approx(exact, abs=1e-6 * exact.max())  # the joints' flexibility is held above 1e-9


@settings(max_examples=30, deadline=None)
@given(storeys=storeys)
def test_soft_joints_make_it_a_bending_cantilever(storeys: Vector) -> None:
    found = np.linalg.inv(lateral_stiffness(storeys, joints=1e8, rocking=0.0, bending=0.0).stiffness)
    exact = cantilever_flexibility(storeys)
    assert found == pytest.approx(exact, rel=1e-4)  # girders of 1e-8 of a column clamp 1e-8 × the stiffest over softest


def test_the_roof_of_a_uniform_cantilever() -> None:
    """Timoshenko: F L³ / 3EI, with EI = k h³ / 12."""
    found = np.linalg.inv(lateral_stiffness(np.full(5, 3.0), joints=1e8, rocking=0.0, bending=0.0).stiffness)
    assert found[-1, -1] == pytest.approx(5**3 / 3 * 12 / 3.0, rel=1e-5)


@settings(max_examples=30, deadline=None)
@given(storeys=storeys, joints=joints, rocking=rocking, bending=bending)
def test_rocking_and_bending_add_to_the_flexibility(
    storeys: Vector, joints: float, rocking: float, bending: float
) -> None:
    """As much at the roof as the shares say of the storeys' Σ 1/k; and below as a line, as a uniform beam."""
    still, moved = (
        np.linalg.inv(lateral_stiffness(storeys, joints, *each).stiffness) for each in ((0, 0), (rocking, bending))
    )
    shape, beam = heights(storeys.size), cantilever_flexibility(np.ones(storeys.size))
    added = rocking * np.outer(shape, shape) + bending * beam / beam[-1, -1]
    assert moved - still == pytest.approx(np.sum(1 / storeys) * added, abs=1e-9 * moved.max())


@settings(max_examples=30, deadline=None)
@given(storeys=storeys, joints=joints, rocking=rocking, bending=bending)
def test_stiffness_is_symmetric_and_positive(storeys: Vector, joints: float, rocking: float, bending: float) -> None:
    K = lateral_stiffness(storeys, joints, rocking, bending).stiffness
    assert np.abs(K - K.T).max() < 1e-9 * K.max()
    assert np.linalg.eigvalsh(K).min() > 0


@settings(max_examples=30, deadline=None)
@given(storeys=storeys, joints=joints, rocking=rocking, bending=bending)
def test_every_flexibility_softens(storeys: Vector, joints: float, rocking: float, bending: float) -> None:
    """In every direction: no stiffness grows (Löwner's order)."""
    K = lateral_stiffness(storeys, joints, rocking, bending)
    for softened in (K.by_joints, K.by_rocking, K.by_bending):
        assert np.linalg.eigvalsh((softened + softened.T) / 2).max() < 1e-9 * K.stiffness.max()


@settings(max_examples=30, deadline=None)
@given(storeys=storeys, flexibilities=st.tuples(*[st.floats(0.01, 2.0)] * 3).map(np.array))
def test_derivatives_agree_with_differences(storeys: Vector, flexibilities: Vector) -> None:
    """By logarithms: of every storey's stiffness, of the flexibilities of joints, rocking and bending."""
    at = np.log(np.concatenate([storeys, flexibilities]))
    found = lateral_stiffness(storeys, *flexibilities)
    derivatives = [*found.by_storey, found.by_joints, found.by_rocking, found.by_bending]
    for move, derivative in zip(STEP * np.eye(at.size), derivatives, strict=True):
        ahead, behind = (
            lateral_stiffness(np.exp(each[: storeys.size]), *np.exp(each[storeys.size :])).stiffness
            for each in (at + move, at - move)
        )
        assert derivative == pytest.approx((ahead - behind) / (2 * STEP), abs=1e-6 * found.stiffness.max())


@settings(max_examples=30, deadline=None)
@given(storeys=storeys, joints=joints, rocking=rocking, bending=bending, factor=st.floats(0.1, 10.0))
def test_stiffness_scales_with_that_of_all_storeys(
    storeys: Vector, joints: float, rocking: float, bending: float, factor: float
) -> None:
    """So that the derivatives by all storeys together are the stiffness itself (Euler's theorem)."""
    found, scaled = (lateral_stiffness(each, joints, rocking, bending) for each in (storeys, factor * storeys))
    tolerance = 1e-9 * found.stiffness.max()
    assert scaled.stiffness / factor == pytest.approx(found.stiffness, abs=tolerance)
    assert found.by_storey.sum(axis=0) == pytest.approx(found.stiffness, abs=tolerance)
