from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from core.arrays import Matrix, Vector
from core.building import ShearBuilding, fixed_base_modes, storey_stiffness_matrix
from core.estimators.frame.model import Design, Layout, heights, lateral_stiffness, modal_changes, superstructure
from core.paper import BUILDING

DESIGN = Design.of(BUILDING.floor_mass, None, np.array([2, 6]))
LAYOUT = DESIGN.layout
NONE = np.log(1e-12)
"""Logarithm of a negligible flexibility."""

seeds = st.integers(0, 2**32 - 1)


def parameters(seed: int) -> Vector:
    """Structural ones at random, sensors and transients at rest."""
    result = np.zeros(LAYOUT.size)
    result[: LAYOUT.structural] = 0.3 * np.random.default_rng(seed).standard_normal(LAYOUT.structural)
    result[LAYOUT.flexibilities] += np.log([0.1, 0.3, 0.05])
    result[LAYOUT.damping] += np.log([0.002, 0.02, 0.1])
    return result


@settings(max_examples=30, deadline=None)
@given(floors=st.integers(1, 20), channels=st.integers(2, 21))
def test_every_parameter_has_one_place(floors: int, channels: int) -> None:
    layout = Layout(floors, channels)
    parts = [slice(layout.scale, layout.scale + 1), layout.storeys, layout.masses, layout.flexibilities, layout.damping]
    parts += [layout.modal_damping, layout.gains, layout.delays, layout.transients]
    assert parts[0].start == 0
    assert all(earlier.stop == later.start for earlier, later in pairwise(parts))
    sizes = [1, floors, floors, 3, 3, floors, channels, channels, 2 * floors]
    assert [part.stop - part.start for part in parts] == sizes
    assert layout.modal_damping.stop == layout.structural
    assert layout.transients.stop == layout.size


def test_a_design_has_its_first_mode_at_one_hertz() -> None:
    building = ShearBuilding(1.0, DESIGN.floor_mass, DESIGN.storey_stiffness, 0.0)
    assert fixed_base_modes(building).frequency[0] == pytest.approx(1.0)
    assert np.ptp(DESIGN.storey_stiffness) == 0  # equal columns where no stiffness is given
    reported = Design.of(BUILDING.floor_mass, BUILDING.storey_stiffness, np.array([6]))
    share = reported.storey_stiffness / BUILDING.storey_stiffness
    assert share == pytest.approx(share[0])


@settings(max_examples=30, deadline=None)
@given(seed=seeds)
def test_modes_of_the_shear_limit(seed: int) -> None:
    """Without rocking and bending, with rigid joints: eq 3 of the paper."""
    given_parameters = parameters(seed)
    given_parameters[LAYOUT.flexibilities] = NONE
    structure = superstructure(given_parameters, DESIGN)
    exact = fixed_base_modes(ShearBuilding(1.0, structure.mass, structure.lateral.storey_stiffness, 0.0))
    assert structure.frequencies == pytest.approx(exact.frequency, rel=1e-6)
    assert structure.shapes == pytest.approx(exact.shape, abs=1e-6 * exact.shape.max())


def test_parameters_at_zero_are_the_design() -> None:
    at_rest = np.zeros(LAYOUT.size)
    at_rest[LAYOUT.flexibilities] = NONE
    structure = superstructure(at_rest, DESIGN)
    assert structure.mass == pytest.approx(DESIGN.floor_mass)
    assert structure.lateral.storey_stiffness == pytest.approx(DESIGN.storey_stiffness)
    assert structure.frequencies[0] == pytest.approx(1.0, rel=1e-6)


@settings(max_examples=30, deadline=None)
@given(seed=seeds)
def test_steps_of_stiffness_run_upwards(seed: int) -> None:
    structure = superstructure(parameters(seed), DESIGN)
    steps = np.diff(np.log(structure.lateral.storey_stiffness / DESIGN.storey_stiffness))
    assert steps == pytest.approx(parameters(seed)[LAYOUT.storeys][1:])


@settings(max_examples=30, deadline=None)
@given(seed=seeds)
def test_the_total_mass_stays(seed: int) -> None:
    structure = superstructure(parameters(seed), DESIGN)
    assert structure.mass.sum() == pytest.approx(DESIGN.floor_mass.sum())
    ratio = np.log(structure.mass / DESIGN.floor_mass)
    assert np.diff(ratio) == pytest.approx(np.diff(parameters(seed)[LAYOUT.masses]))


@settings(max_examples=30, deadline=None)
@given(seed=seeds)
def test_modes_are_normalised(seed: int) -> None:
    structure = superstructure(parameters(seed), DESIGN)
    assert structure.shapes.T @ (structure.mass[:, None] * structure.shapes) == pytest.approx(np.eye(7), abs=1e-9)
    assert structure.inputs[:, 0] == pytest.approx(structure.shapes.T @ structure.mass)
    assert structure.inputs[:, 2:] == pytest.approx(structure.shapes.T * structure.mass)
    assert (structure.shapes[-1] > 0).all()


@settings(max_examples=30, deadline=None)
@given(seed=seeds)
def test_damping_ratios(seed: int) -> None:
    """α K damps a mode by αω/2, i η K by η/2 (hysteretic), β M by β/2ω (Chopra 2017, sec. 11.4), each times its own."""
    structure = superstructure(parameters(seed), DESIGN)
    ω = 2 * np.pi * structure.frequencies
    α, η, β = np.exp(parameters(seed)[LAYOUT.damping])
    own = np.exp(parameters(seed)[LAYOUT.modal_damping])
    assert structure.damping_ratios == pytest.approx(own * (α * ω / 2 + η / 2 + β / (2 * ω)))


@settings(max_examples=30, deadline=None)
@given(seed=seeds)
def test_derivatives_are_those_of_the_modal_stiffness(seed: int) -> None:
    """dω²/dp = φᵀ dK/dp φ (Fox and Kapoor 1968), against central differences of step 1e-5, right to 1e-8."""
    at, step = parameters(seed), 1e-5
    structure = superstructure(at, DESIGN)
    places = [LAYOUT.scale, *range(LAYOUT.storeys.start, LAYOUT.storeys.stop)]
    places += range(LAYOUT.flexibilities.start, LAYOUT.flexibilities.stop)
    for place, derivative in zip(places, structure.stiffness_derivatives, strict=True):
        move = step * (np.arange(LAYOUT.size) == place)
        ahead, behind = superstructure(at + move, DESIGN).squared, superstructure(at - move, DESIGN).squared
        assert np.diag(derivative) == pytest.approx((ahead - behind) / (2 * step), abs=1e-6 * structure.squared[-1])


@settings(max_examples=30, deadline=None)
@given(seed=seeds)
def test_changes_of_the_modes(seed: int) -> None:
    """Against central differences of step 1e-5, right to 1e-8 of the largest but where two frequencies are close."""
    at, step = parameters(seed), 1e-5
    structure = superstructure(at, DESIGN)
    changes = modal_changes(structure)
    for place in range(LAYOUT.structural):
        move = step * (np.arange(LAYOUT.size) == place)
        ahead, behind = superstructure(at + move, DESIGN), superstructure(at - move, DESIGN)
        for change, name in zip(changes, ("squared", "shapes", "damping_ratios"), strict=True):
            difference = (getattr(ahead, name) - getattr(behind, name)) / (2 * step)
            assert change[place] == pytest.approx(difference, abs=1e-6 * np.abs(getattr(structure, name)).max())


STEP = 1e-5
"""Step of a logarithm: central differences are then right to 1e-9, by truncation and by rounding alike."""

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
    stiffness = lateral_stiffness(storeys, joints=0.0, rocking=0.0, bending=0.0).stiffness
    assert stiffness == pytest.approx(exact, abs=1e-6 * exact.max())  # the joints' flexibility is kept above 1e-9


@settings(max_examples=30, deadline=None)
@given(storeys=storeys)
def test_soft_joints_make_it_a_bending_cantilever(storeys: Vector) -> None:
    result = np.linalg.inv(lateral_stiffness(storeys, joints=1e8, rocking=0.0, bending=0.0).stiffness)
    exact = cantilever_flexibility(storeys)
    assert result == pytest.approx(
        exact, rel=1e-4
    )  # girders of 1e-8 of a column clamp 1e-8 × the stiffest over softest


def test_the_roof_of_a_uniform_cantilever() -> None:
    """Timoshenko: F L³ / 3EI, with EI = k h³ / 12."""
    result = np.linalg.inv(lateral_stiffness(np.full(5, 3.0), joints=1e8, rocking=0.0, bending=0.0).stiffness)
    assert result[-1, -1] == pytest.approx(5**3 / 3 * 12 / 3.0, rel=1e-5)


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
    by = K.derivatives()
    for softened in (by.by_joints, by.by_rocking, by.by_bending):
        assert np.linalg.eigvalsh((softened + softened.T) / 2).max() < 1e-9 * K.stiffness.max()


@settings(max_examples=30, deadline=None)
@given(storeys=storeys, flexibilities=st.tuples(*[st.floats(0.01, 2.0)] * 3).map(np.array))
def test_derivatives_agree_with_differences(storeys: Vector, flexibilities: Vector) -> None:
    """By logarithms: of every storey's stiffness, of the flexibilities of joints, rocking and bending."""
    at = np.log(np.concatenate([storeys, flexibilities]))
    stiffness = lateral_stiffness(storeys, *flexibilities)
    by = stiffness.derivatives()
    derivatives = [*by.by_storey, by.by_joints, by.by_rocking, by.by_bending]
    for move, derivative in zip(STEP * np.eye(at.size), derivatives, strict=True):
        ahead, behind = (
            lateral_stiffness(np.exp(each[: storeys.size]), *np.exp(each[storeys.size :])).stiffness
            for each in (at + move, at - move)
        )
        assert derivative == pytest.approx((ahead - behind) / (2 * STEP), abs=1e-6 * stiffness.stiffness.max())


@settings(max_examples=30, deadline=None)
@given(storeys=storeys, joints=joints, rocking=rocking, bending=bending, factor=st.floats(0.1, 10.0))
def test_stiffness_scales_with_that_of_all_storeys(
    storeys: Vector, joints: float, rocking: float, bending: float, factor: float
) -> None:
    """So that the derivatives by all storeys together are the stiffness itself (Euler's theorem)."""
    stiffness, scaled = (lateral_stiffness(each, joints, rocking, bending) for each in (storeys, factor * storeys))
    tolerance = 1e-9 * stiffness.stiffness.max()
    assert scaled.stiffness / factor == pytest.approx(stiffness.stiffness, abs=tolerance)
    assert stiffness.derivatives().by_storey.sum(axis=0) == pytest.approx(stiffness.stiffness, abs=tolerance)
