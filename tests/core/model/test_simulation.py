from dataclasses import replace

import numpy as np
import pytest
from ground_motions import akt013, kobe
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.signal import StateSpace, lsim

from core import paper
from core.arrays import Vector
from core.building import damping_matrix, fixed_base_modes, mass_matrix, stiffness_matrix
from core.errors import ModelError, RecordError
from core.model.isolator import Conditions, Isolator
from core.model.simulation import Axis, Response, respond, simulate

RATE = 100.0
MODES = fixed_base_modes(paper.BUILDING)
COUPLED = Isolator({**paper.ISOLATOR.effects, "biaxial": {"joined": 1.0, "D_cross": 1.5e-3}})
LINEAR = Isolator({"elastic": {"k_b": 475e6}, "viscous": {"c_b": 6e6}})


def ground(seconds: float = 40.0, peak: float = 0.7) -> Vector:
    """A burst of band-limited noise, m/s²."""
    rng = np.random.default_rng(11)
    t = np.arange(0.0, seconds, 1 / RATE)
    waves = sum(
        rng.standard_normal() * np.sin(2 * np.pi * f * t + rng.uniform(0, 6)) / f for f in np.linspace(0.2, 8, 60)
    )
    burst = waves * np.sin(np.pi * t / seconds) ** 2
    return peak * burst / abs(burst).max()


def error(of: Response, truth: Response) -> float:
    return float(np.linalg.norm(of.force - truth.force) / np.linalg.norm(truth.force))


def test_a_linear_building_follows_the_exact_solution() -> None:
    """Eq 1 by matrix exponentials (scipy's lsim), as exact for a ground that is linear between samples.

    1e-6: three steps per sample turn the highest mode by 0.2 rad each.
    """
    M = mass_matrix(paper.BUILDING)
    n = len(M)
    K, C = stiffness_matrix(paper.BUILDING, 475e6), damping_matrix(paper.BUILDING, 6e6)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    B = np.concatenate([np.zeros(n), -np.ones(n)])[:, None]
    motion = ground()
    _, exact, _ = lsim(StateSpace(A, B, np.eye(2 * n), np.zeros((2 * n, 1))), motion, np.arange(motion.size) / RATE)
    response = simulate(paper.BUILDING, LINEAR, motion, RATE)
    displacement = exact[:, n - 1]
    assert response.isolator_displacement == pytest.approx(displacement, abs=1e-6 * abs(displacement).max())
    roof = exact[:, n - 2] - displacement
    assert response.floor_displacement[-1] == pytest.approx(roof, abs=1e-6 * abs(roof).max())


def test_the_force_is_within_1e_5_of_a_converged_run() -> None:
    motion = ground()
    truth = simulate(paper.BUILDING, paper.ISOLATOR, motion, RATE, substeps=200)
    assert error(simulate(paper.BUILDING, paper.ISOLATOR, motion, RATE), truth) <= 1e-5


def test_order_of_convergence() -> None:
    """Four while everything is smooth; the kinks of Bouc-Wen leave two."""
    motion = ground()
    for layer, order in ((LINEAR, 4), (paper.ISOLATOR, 2)):
        truth = simulate(paper.BUILDING, layer, motion, RATE, substeps=200)
        coarse, fine = (error(simulate(paper.BUILDING, layer, motion, RATE, substeps=s), truth) for s in (2, 8))
        assert np.log(coarse / fine) / np.log(4) == pytest.approx(order, abs=0.4)


def test_agrees_with_an_adaptive_solver() -> None:
    """LSODA over the same equations, written down again; 2e-5 is what its tolerance of 1e-8 leaves at the kinks."""
    motion = ground(12.0)
    t = np.arange(motion.size) / RATE
    M = mass_matrix(paper.BUILDING)
    n = len(M)
    K, C = stiffness_matrix(paper.BUILDING, 475e6), damping_matrix(paper.BUILDING, 6e6)
    to_k, to_c = np.linalg.solve(M, K), np.linalg.solve(M, C)

    def rates(at: float, y: Vector) -> Vector:
        x, v, z = y[:n], y[n:-1], y[-1]
        acceleration = -to_k @ x - to_c @ v - np.interp(at, t, motion)
        acceleration[-1] -= 655.4e3 * z / M[-1, -1]
        z_rate = (v[-1] - (0.4 * np.sign(z * v[-1]) + 0.6) * abs(z) * v[-1]) / 1.5e-3
        return np.concatenate([v, acceleration, [z_rate]])

    solved = solve_ivp(rates, (0, t[-1]), np.zeros(2 * n + 1), "LSODA", t, rtol=1e-8, atol=1e-11, max_step=0.01).y
    force = 475e6 * solved[n - 1] + 6e6 * solved[2 * n - 1] + 655.4e3 * solved[-1]
    ours = simulate(paper.BUILDING, paper.ISOLATOR, motion, RATE)
    assert np.linalg.norm(ours.force - force) <= 2e-5 * np.linalg.norm(force)


def test_the_layers_force_is_the_inertia_of_all_levels() -> None:
    """F = -Σ m_i a_i at every sample, to rounding."""
    response = simulate(paper.BUILDING, paper.ISOLATOR, ground(), RATE)
    inertia = 8e6 * response.base_acceleration + paper.BUILDING.floor_mass @ response.floor_acceleration
    assert abs(response.force + inertia).max() <= 1e-10 * abs(response.force).max()


def test_conditions_reach_the_laws_and_change_nothing_that_does_not_ask_for_them() -> None:
    motion = ground(10.0)
    hot = Conditions(*(np.full(motion.size, value) for value in (0.1, 0.2, 1.5, 40.0, 1e7, 3.0)))
    plain = simulate(paper.BUILDING, paper.ISOLATOR, motion, RATE)
    assert (simulate(paper.BUILDING, paper.ISOLATOR, motion, RATE, conditions=hot).force == plain.force).all()
    with pytest.raises(RecordError, match="conditions are given for 7 samples"):
        simulate(paper.BUILDING, paper.ISOLATOR, motion, RATE, conditions=Conditions.usual(7, RATE))


def test_a_slow_sampling_rate_gets_more_substeps_by_itself() -> None:
    """At 2 Hz three steps per sample would be unstable; the ground is linear between its samples at either rate."""
    slow = ground()[::50]
    fast = np.interp(np.arange(0, (slow.size - 1) / 2 + 1e-9, 0.01), np.arange(slow.size) / 2, slow)
    coarse = simulate(paper.BUILDING, LINEAR, slow, 2.0)
    fine = simulate(paper.BUILDING, LINEAR, fast, RATE)
    assert coarse.force == pytest.approx(fine.force[::50], abs=1e-2 * abs(fine.force).max())


def test_a_light_base_slab_gets_more_substeps_by_itself() -> None:
    """Between layer and first storey a slab of 1 t shakes at 280 Hz; the fixed-base modes end below 10 Hz."""
    motion = ground(10.0)
    light = replace(paper.BUILDING, base_mass=1e3)
    truth = simulate(light, paper.ISOLATOR, motion, RATE, substeps=400)
    assert error(simulate(light, paper.ISOLATOR, motion, RATE), truth) <= 1e-5


def test_energy_is_neither_made_nor_lost() -> None:
    """The energy that the ground puts in is stored or dissipated: eq 1 times the velocities, integrated.

    1e-5 of the input: the histories are splines through samples 1 ms apart, and the force turns sharply between them.
    """
    t = np.arange(0.0, 20.0, 1e-3)
    motion = np.interp(t, np.arange(0.0, 20.0, 1 / RATE), ground(20.0))
    response = simulate(paper.BUILDING, paper.ISOLATOR, motion, 1000.0)
    relative = CubicSpline(t, response.floor_displacement, axis=1)(t, 1)
    velocity = np.vstack([relative + response.isolator_velocity, response.isolator_velocity])
    mass = np.diag(mass_matrix(paper.BUILDING))
    drift = np.diff(response.floor_displacement, axis=0, prepend=0.0)
    drift_rate = np.diff(relative, axis=0, prepend=0.0)
    stiffness = paper.BUILDING.storey_stiffness
    power_lost = paper.BUILDING.damping_coefficient * stiffness @ drift_rate**2
    power_lost += response.force * response.isolator_velocity  # the layer's spring gives its share back later
    power_in = -(mass @ velocity) * motion
    stored = 0.5 * mass @ velocity**2 + 0.5 * stiffness @ drift**2
    put_in, lost = (CubicSpline(t, power).antiderivative()(t) for power in (power_in, power_lost))
    assert abs(put_in - lost - stored).max() <= 1e-5 * abs(put_in).max()


def test_a_layer_too_stiff_for_the_steps_is_refused() -> None:
    with pytest.raises(ModelError, match="more substeps"):
        simulate(paper.BUILDING, Isolator({"elastic": {"k_b": 1e12}}), ground(), RATE, substeps=1)


def test_a_ground_motion_with_gaps_is_refused() -> None:
    motion = ground()
    motion[100] = np.nan
    with pytest.raises(RecordError, match="without gaps"):
        simulate(paper.BUILDING, paper.ISOLATOR, motion, RATE)


def coupled(isolator: Isolator) -> tuple[Response, Response]:
    """Two recorded motions at once."""
    count = 4000
    axes = [Axis(MODES, motion()[:count], Conditions.usual(count, RATE)) for motion in (akt013, kobe)]
    x, y = respond(axes, paper.BUILDING.base_mass, isolator, RATE)
    return x, y


def test_two_directions_that_know_nothing_of_each_other_respond_as_each_alone() -> None:
    """To rounding: one direction and two are compiled apart."""
    for motion, result in zip((akt013, kobe), coupled(paper.ISOLATOR), strict=True):
        axis = Axis(MODES, motion()[:4000], Conditions.usual(4000, RATE))
        (alone,) = respond([axis], paper.BUILDING.base_mass, paper.ISOLATOR, RATE)
        for quantity in ("isolator_displacement", "floor_acceleration"):
            one, both = getattr(alone, quantity), getattr(result, quantity)
            assert both == pytest.approx(one, abs=1e-12 * np.abs(one).max())


def test_each_direction_sees_the_other_as_it_is_computed() -> None:
    """One direction alone, given what the other did at each sample: the same but for what that does between samples."""
    x, y = coupled(COUPLED)
    for recorded, own, other in ((akt013, x, y), (kobe, y, x)):
        usual = Conditions.usual(4000, RATE)
        measured = replace(usual, u_cross=other.isolator_displacement, v_cross=other.isolator_velocity)
        for given, low, high in ((measured, 0.0, 2e-4), (usual, 0.05, 1.0)):
            (alone,) = respond([Axis(MODES, recorded()[:4000], given)], paper.BUILDING.base_mass, COUPLED, RATE)
            apart = np.linalg.norm(alone.isolator_displacement - own.isolator_displacement)
            assert low <= apart / np.linalg.norm(own.isolator_displacement) < high
