import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy import linalg

from core.building import damping_matrix, fixed_base_modes, mass_matrix, stiffness_matrix
from core.identification.modes import mass_normalised, modal_assurance, poles, real_shape
from core.paper import BUILDING

RATE = 100.0
phases = st.floats(-np.pi, np.pi)


def complex_shape(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.standard_normal(4) + 1j * rng.standard_normal(4)


def test_poles_are_those_of_the_building_they_were_sampled_from() -> None:
    """Exact: the fixed-base superstructure's own state matrix, seen at the fourth storey and the roof."""
    whole = mass_matrix(BUILDING), damping_matrix(BUILDING, 0), stiffness_matrix(BUILDING, 0)
    M, C, K = (matrix[:-1, :-1] for matrix in whole)  # the base slab comes last, and is fixed
    still = np.zeros_like(M)
    continuous = np.block([[still, np.eye(7)], [-linalg.solve(M, K), -linalg.solve(M, C)]])
    modes = poles(linalg.expm(continuous / RATE), np.eye(14)[[2, 6]], RATE)
    exact = fixed_base_modes(BUILDING)
    assert modes.frequency == pytest.approx(exact.frequency, rel=1e-9)
    assert modes.damping_ratio == pytest.approx(exact.damping_ratio, rel=1e-8)
    for shape, truth in zip(modes.shapes.T, exact.shape[[2, 6]].T, strict=True):
        assert real_shape(shape) == pytest.approx(truth / truth[-1], rel=1e-8)


def test_a_growing_mode_has_a_negative_damping_ratio_and_a_real_eigenvalue_is_no_mode() -> None:
    angle, radius = 0.4, 1.01
    A = linalg.block_diag(radius * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]), [[0.5]])
    modes = poles(A, np.ones((1, 3)), RATE)
    assert modes.frequency.size == 1
    assert modes.damping_ratio[0] == pytest.approx(-np.log(radius) / np.hypot(np.log(radius), angle))


@given(st.integers(0, 2**32 - 1), phases)
def test_a_real_shape_comes_back_whatever_its_phase(seed: int, phase: float) -> None:
    shape = np.append(np.random.default_rng(seed).standard_normal(3), 1.0)
    assert real_shape(2.5 * np.exp(1j * phase) * shape) == pytest.approx(shape, abs=1e-9)


@given(st.integers(0, 2**32 - 1), st.integers(0, 2**32 - 1), phases)
def test_modal_assurance_does_not_depend_on_length_and_phase(one: int, other: int, phase: float) -> None:
    first, second = complex_shape(one), complex_shape(other)
    assurance = modal_assurance(first, second)
    assert 0 <= assurance <= 1 + 1e-12
    assert modal_assurance(3 * np.exp(1j * phase) * first, second) == pytest.approx(assurance)
    assert modal_assurance(first, first) == pytest.approx(1)


def test_orthogonal_shapes_have_no_modal_assurance() -> None:
    assert modal_assurance(np.array([1, 1j]), np.array([1, -1j])) == pytest.approx(0)


@given(st.lists(st.floats(0.01, 100), min_size=2, max_size=2))
def test_mass_normalised_shapes_of_any_length_are_the_eigenvalue_problems(lengths: list[float]) -> None:
    exact = fixed_base_modes(BUILDING).shape[:, :2]
    assert mass_normalised(exact * lengths, BUILDING.floor_mass) == pytest.approx(exact, rel=1e-9)  # rounding
