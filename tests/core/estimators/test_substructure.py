import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from random_buildings import buildings
from scipy.linalg import block_diag, expm, solve

from core import paper
from core.arrays import Matrix, Vector
from core.building import ShearBuilding, damping_matrix, fixed_base_modes, mass_matrix, stiffness_matrix
from core.errors import ModelError
from core.estimators.substructure import (
    assumed_stiffness,
    expanded,
    hybrid_equations,
    modal_acceleration,
    modal_force,
    rigid_force,
    static_shapes,
)
from core.model.simulation import simulate


def response(mass: Matrix, damping: Matrix, stiffness: Matrix, load: Matrix, dt: float) -> tuple[Matrix, Matrix]:
    """Displacement and acceleration from rest, exact for a load (dof, n) that is constant between samples."""
    n = len(mass)
    state = np.block([[np.zeros((n, n)), np.eye(n)], [-solve(mass, stiffness), -solve(mass, damping)]])
    given = np.vstack([np.zeros((n, n)), np.linalg.inv(mass)])
    step = expm(np.block([[state, given], [np.zeros((n, 3 * n))]]) * dt)
    y, ys = np.zeros(2 * n), []
    for f in load.T:
        ys.append(y)
        y = step[: 2 * n, : 2 * n] @ y + step[: 2 * n, 2 * n :] @ f
    history = np.array(ys).T
    return history[:n], (state @ history + given @ load)[n:]


def loads(building: ShearBuilding, seed: int) -> tuple[Vector, Vector]:
    """Ground acceleration in m/s², and a force of the layer beyond its linear part in N."""
    rng = np.random.default_rng(seed)
    return rng.standard_normal(200), building.total_mass * 0.1 * rng.standard_normal(200)


@given(building=buildings(), k=st.floats(1e6, 1e9), c=st.floats(0.0, 1e7), seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_hybrid_and_physical_equations_give_the_same_response(
    building: ShearBuilding, k: float, c: float, seed: int
) -> None:
    """Eq 7 against eq 1, to 1e-9 of the largest displacement, as required."""
    ground, f_nl = loads(building, seed)
    M = mass_matrix(building)
    beyond = np.append(np.zeros(building.floor_mass.size), 1.0)
    physical, _ = response(
        M,
        damping_matrix(building, c),
        stiffness_matrix(building, k),
        -np.outer(M.diagonal(), ground) - np.outer(beyond, f_nl),
        0.01,
    )
    hybrid = hybrid_equations(building, k, c)
    coordinates, _ = response(
        hybrid.mass,
        hybrid.damping,
        hybrid.stiffness,
        -np.outer(hybrid.influence, ground) - np.outer(beyond, f_nl),
        0.01,
    )
    assert abs(hybrid.transformation @ coordinates - physical).max() <= 1e-9 * abs(physical).max()


@given(building=buildings(), k=st.floats(1e6, 1e9), c=st.floats(0.0, 1e7))
def test_hybrid_matrices_are_those_of_equation_7(building: ShearBuilding, k: float, c: float) -> None:
    hybrid, modes = hybrid_equations(building, k, c), fixed_base_modes(building)
    squared = modes.angular_frequency**2
    assert hybrid.stiffness == pytest.approx(block_diag(np.diag(squared), k), abs=1e-8 * max(k, squared[-1]))
    assert hybrid.damping == pytest.approx(
        block_diag(building.damping_coefficient * np.diag(squared), c), abs=1e-6 * max(c, 1.0)
    )
    assert hybrid.mass[-1, -1] == pytest.approx(building.total_mass)
    assert hybrid.mass[:-1, -1] == pytest.approx(modes.shape.T @ building.floor_mass)
    assert hybrid.mass[:-1, :-1] == pytest.approx(np.eye(6), abs=1e-9)


def test_the_error_of_truncation_falls_with_every_mode_kept() -> None:
    """Eq 8; with all modes kept it is eq 7."""
    building, k, c = paper.BUILDING, 475e6, 6e6
    ground, f_nl = loads(building, 3)
    displacement = []
    for modes in range(1, 8):
        hybrid = hybrid_equations(building, k, c, modes)
        force = -np.outer(hybrid.influence, ground) - np.outer(np.append(np.zeros(modes), 1.0), f_nl)
        q, _ = response(hybrid.mass, hybrid.damping, hybrid.stiffness, force, 0.01)
        displacement.append(hybrid.transformation @ q)
    error = [np.linalg.norm(x - displacement[-1]) for x in displacement]
    assert all(np.diff(error) < 0)
    with pytest.raises(ModelError, match="1 to 7 modes to keep, got 8"):
        hybrid_equations(building, k, c, 8)


def test_the_force_is_its_rigid_and_its_modal_part() -> None:
    """Eq 10 with all modes is the simulated force of the layer, to the rounding of its cancelling terms."""
    ground, _ = loads(paper.BUILDING, 5)
    simulated = simulate(paper.BUILDING, paper.ISOLATOR, ground, 100.0)
    shape = fixed_base_modes(paper.BUILDING).shape
    modal_acceleration = np.linalg.inv(shape) @ (simulated.floor_acceleration - simulated.base_acceleration)
    rigid = rigid_force(paper.BUILDING.total_mass, simulated.base_acceleration)
    modal = modal_force(paper.BUILDING.floor_mass, shape, modal_acceleration)
    assert abs(rigid + modal - simulated.force).max() <= 1e-9 * abs(simulated.force).max()
    assert np.linalg.norm(rigid) > np.linalg.norm(modal) > 0


seeds = st.integers(0, 2**32 - 1)


def test_a_uniform_chain_deflects_in_a_straight_line() -> None:
    """Exact: without load between them, springs in series share the displacement evenly."""
    shapes = static_shapes(np.full(6, 1e9), np.array([2, 5]))
    assert shapes[:, 0] == pytest.approx([1 / 3, 2 / 3, 1, 2 / 3, 1 / 3, 0])
    assert shapes[:, 1] == pytest.approx([0, 0, 0, 1 / 3, 2 / 3, 1])


def test_floors_above_the_highest_sensor_move_with_it() -> None:
    assert static_shapes(np.ones(4), np.array([1]))[:, 0] == pytest.approx([0.5, 1, 1, 1])


@given(seed=seeds, floors=st.integers(1, 12))
def test_shapes_keep_what_was_measured_and_ignore_the_stiffness_scale(seed: int, floors: int) -> None:
    rng = np.random.default_rng(seed)
    measured = np.sort(rng.choice(floors, rng.integers(1, floors + 1), replace=False))
    stiffness, shapes = rng.uniform(1e8, 1e10, floors), rng.standard_normal((measured.size, 3))
    full = expanded(shapes, stiffness, measured)
    assert full[measured] == pytest.approx(shapes)
    assert expanded(shapes, 7 * stiffness, measured) == pytest.approx(full)


@given(seed=seeds)
def test_modal_coordinates_come_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    measured = np.array([0, 2, 5])
    # Well-conditioned shapes, so that rounding stays below the default tolerance.
    shapes = expanded(np.linalg.qr(rng.standard_normal((3, 3))).Q[:, :2], assumed_stiffness(np.ones(6)), measured)
    modal = rng.standard_normal((2, 50))
    assert modal_acceleration(shapes, measured, shapes[measured] @ modal) == pytest.approx(modal)


@pytest.mark.parametrize("measured", [[], [3, 2], [1, 1], [6], [-1]])
def test_refuses_floors_that_are_not_there(measured: list[int]) -> None:
    with pytest.raises(ModelError, match=r"must rise within 0 \.\.\. 5"):
        static_shapes(np.ones(6), np.array(measured, dtype=int))


def test_refuses_a_storey_without_stiffness() -> None:
    with pytest.raises(ModelError, match="must be positive"):
        static_shapes(np.array([1.0, 0.0]), np.array([1]))
