from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from core.arrays import Vector
from core.building import ShearBuilding, fixed_base_modes
from core.estimators.frame.superstructure_model import Design, Layout, modal_changes, superstructure
from core.paper import BUILDING

DESIGN = Design.of(BUILDING.floor_mass, None, np.array([2, 6]))
LAYOUT = DESIGN.layout
NONE = np.log(1e-12)
"""Of a flexibility that is as good as none."""

seeds = st.integers(0, 2**32 - 1)


def parameters(seed: int) -> Vector:
    """Structural ones at random, sensors and transients at rest."""
    found = np.zeros(LAYOUT.size)
    found[: LAYOUT.structural] = 0.3 * np.random.default_rng(seed).standard_normal(LAYOUT.structural)
    found[LAYOUT.flexibilities] += np.log([0.1, 0.3, 0.05])
    found[LAYOUT.damping] += np.log([0.002, 0.02, 0.1])
    return found


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
    told = Design.of(BUILDING.floor_mass, BUILDING.storey_stiffness, np.array([6]))
    share = told.storey_stiffness / BUILDING.storey_stiffness
    assert share == pytest.approx(share[0])


@settings(max_examples=30, deadline=None)
@given(seed=seeds)
def test_modes_of_the_shear_limit(seed: int) -> None:
    """Without rocking and bending, with rigid joints: eq 3 of the paper."""
    given_parameters = parameters(seed)
    given_parameters[LAYOUT.flexibilities] = NONE
    found = superstructure(given_parameters, DESIGN)
    exact = fixed_base_modes(ShearBuilding(1.0, found.mass, found.storey_stiffness, 0.0))
    assert found.frequencies == pytest.approx(exact.frequency, rel=1e-6)
    assert found.shapes == pytest.approx(exact.shape, abs=1e-6 * exact.shape.max())


def test_parameters_at_zero_are_the_design() -> None:
    at_rest = np.zeros(LAYOUT.size)
    at_rest[LAYOUT.flexibilities] = NONE
    found = superstructure(at_rest, DESIGN)
    assert found.mass == pytest.approx(DESIGN.floor_mass)
    assert found.storey_stiffness == pytest.approx(DESIGN.storey_stiffness)
    assert found.frequencies[0] == pytest.approx(1.0, rel=1e-6)


@settings(max_examples=30, deadline=None)
@given(seed=seeds)
def test_steps_of_stiffness_run_upwards(seed: int) -> None:
    found = superstructure(parameters(seed), DESIGN)
    steps = np.diff(np.log(found.storey_stiffness / DESIGN.storey_stiffness))
    assert steps == pytest.approx(parameters(seed)[LAYOUT.storeys][1:])


@settings(max_examples=30, deadline=None)
@given(seed=seeds)
def test_the_total_mass_stays(seed: int) -> None:
    found = superstructure(parameters(seed), DESIGN)
    assert found.mass.sum() == pytest.approx(DESIGN.floor_mass.sum())
    ratio = np.log(found.mass / DESIGN.floor_mass)
    assert np.diff(ratio) == pytest.approx(np.diff(parameters(seed)[LAYOUT.masses]))


@settings(max_examples=30, deadline=None)
@given(seed=seeds)
def test_modes_are_normalised(seed: int) -> None:
    found = superstructure(parameters(seed), DESIGN)
    assert found.shapes.T @ (found.mass[:, None] * found.shapes) == pytest.approx(np.eye(7), abs=1e-9)
    assert found.inputs[:, 0] == pytest.approx(found.shapes.T @ found.mass)
    assert found.inputs[:, 2:] == pytest.approx(found.shapes.T * found.mass)
    assert (found.shapes[-1] > 0).all()


@settings(max_examples=30, deadline=None)
@given(seed=seeds)
def test_damping_ratios(seed: int) -> None:
    """α K damps a mode by αω/2, i η K by η/2 (hysteretic), β M by β/2ω (Chopra 2017, sec. 11.4), each times its own."""
    found = superstructure(parameters(seed), DESIGN)
    ω = 2 * np.pi * found.frequencies
    α, η, β = np.exp(parameters(seed)[LAYOUT.damping])
    own = np.exp(parameters(seed)[LAYOUT.modal_damping])
    assert found.damping_ratios == pytest.approx(own * (α * ω / 2 + η / 2 + β / (2 * ω)))


@settings(max_examples=30, deadline=None)
@given(seed=seeds)
def test_derivatives_are_those_of_the_modal_stiffness(seed: int) -> None:
    """dω²/dp = φᵀ dK/dp φ (Fox and Kapoor 1968), against central differences of step 1e-5, right to 1e-8."""
    at, step = parameters(seed), 1e-5
    found = superstructure(at, DESIGN)
    places = [LAYOUT.scale, *range(LAYOUT.storeys.start, LAYOUT.storeys.stop)]
    places += range(LAYOUT.flexibilities.start, LAYOUT.flexibilities.stop)
    for place, derivative in zip(places, found.stiffness_derivatives, strict=True):
        move = step * (np.arange(LAYOUT.size) == place)
        ahead, behind = superstructure(at + move, DESIGN).squared, superstructure(at - move, DESIGN).squared
        assert np.diag(derivative) == pytest.approx((ahead - behind) / (2 * step), abs=1e-6 * found.squared[-1])


@settings(max_examples=30, deadline=None)
@given(seed=seeds)
def test_changes_of_the_modes(seed: int) -> None:
    """Against central differences of step 1e-5, right to 1e-8 of the largest but where two frequencies are close."""
    at, step = parameters(seed), 1e-5
    found = superstructure(at, DESIGN)
    changes = modal_changes(found)
    for place in range(LAYOUT.structural):
        move = step * (np.arange(LAYOUT.size) == place)
        ahead, behind = superstructure(at + move, DESIGN), superstructure(at - move, DESIGN)
        for change, name in zip(changes, ("squared", "shapes", "damping_ratios"), strict=True):
            difference = (getattr(ahead, name) - getattr(behind, name)) / (2 * step)
            assert change[place] == pytest.approx(difference, abs=1e-6 * np.abs(getattr(found, name)).max())
