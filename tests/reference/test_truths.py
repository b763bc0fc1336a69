"""The exact responses that estimators are judged by are what they are said to be."""

import numpy as np
import pytest
from exact_responses import IN_CLASS, KINDS, MOTIONS, SENSORS, as_prepared, estimator_input, exact_response, recorded
from ground_motions import RATE
from independent_simulation import independent_response
from scipy.linalg import eigh, eigvals

from core.arrays import Matrix
from core.model.simulation import simulate
from core.paper import BUILDING, ISOLATOR

DESIGN = IN_CLASS.building(0)


def distance(result: Matrix, exact: Matrix) -> float:
    return float(np.linalg.norm(result - exact) / np.linalg.norm(exact))


@pytest.mark.parametrize("motion", MOTIONS)
def test_two_integrators_of_different_kind_agree(motion: str) -> None:
    """Both have error 1e-5 at their own number of steps."""
    ours, other = simulate(BUILDING, ISOLATOR, MOTIONS[motion](), RATE), exact_response(IN_CLASS, motion)
    assert distance(other.force, ours.force) < 2e-5
    assert distance(other.displacement, ours.isolator_displacement) < 2e-5
    assert distance(other.velocity, ours.isolator_velocity) < 2e-5
    assert distance(other.acceleration[0], ours.base_acceleration) < 5e-5
    assert distance(other.acceleration[1:], ours.floor_acceleration) < 5e-5


def test_steps_half_as_long_are_a_quarter_as_wrong() -> None:
    """Second order, for reversals lie within steps."""
    ground = MOTIONS["Kobe"]()
    limit = independent_response(DESIGN, ground, RATE, 128).force
    errors = [distance(independent_response(DESIGN, ground, RATE, substeps).force, limit) for substeps in (2, 4, 8, 16)]
    assert errors[-1] < 1e-5
    assert np.log2(errors[0] / errors[-1]) / 3 == pytest.approx(2.0, abs=0.3)


@pytest.mark.parametrize("kind", KINDS)
def test_the_force_is_the_inertia_of_all_levels(kind: str) -> None:
    draw = KINDS[kind].draws - 1
    building, happened = KINDS[kind].building(draw), exact_response(KINDS[kind], "Kobe", draw)
    inertia = -np.append(building.base_mass, building.floor_mass) @ happened.acceleration
    assert np.abs(happened.force - inertia).max() < 1e-12 * np.abs(inertia).max()


@pytest.mark.parametrize("kind", KINDS)
def test_the_total_mass_is_the_designs(kind: str) -> None:
    for draw in range(KINDS[kind].draws):
        building = KINDS[kind].building(draw)
        assert building.floor_mass.min() > 0
        assert building.base_mass + building.floor_mass.sum() == pytest.approx(BUILDING.total_mass)


def fixed_base_damping_ratios(kind: str) -> list[float]:
    building = KINDS[kind].building(0)
    n, mass = building.floor_mass.size, building.floor_mass[:, None]
    system = np.block([[np.zeros((n, n)), np.eye(n)], [-building.stiffness / mass, -building.damping / mass]])
    poles = sorted((pole for pole in eigvals(system) if pole.imag > 0), key=abs)
    return [float(-pole.real / abs(pole)) for pole in poles]


def test_damping_ratios_are_as_named() -> None:
    assert fixed_base_damping_ratios("constant modal damping 2 %") == pytest.approx([0.02] * 7)
    rayleigh = fixed_base_damping_ratios("Rayleigh damping 2 %")
    assert (rayleigh[0], rayleigh[2]) == (pytest.approx(0.02), pytest.approx(0.02))
    assert rayleigh[1] < 0.02 < rayleigh[3] < rayleigh[6]


def test_bending_adds_a_fifth_to_the_roofs_flexibility() -> None:
    bent = KINDS["bending +20 %"].building(0)
    roof = [np.linalg.inv(building.stiffness)[-1, -1] for building in (bent, DESIGN)]
    assert roof[0] / roof[1] == pytest.approx(1.2)
    first = [eigh(b.stiffness, np.diag(b.floor_mass), eigvals_only=True)[0] for b in (bent, DESIGN)]
    assert 1 / 1.2 < first[0] / first[1] < 0.95  # lower floors gain less than the roof


def test_faults_are_those_of_one_sensor() -> None:
    exact = exact_response(IN_CLASS, "Kobe").acceleration[[0, *(floor + 1 for floor in SENSORS)]]
    assert recorded(IN_CLASS, "Kobe", 0.0, 0) == pytest.approx(exact)
    gained = recorded(KINDS["gain +2 %, roof"], "Kobe", 0.0, 0)
    assert gained == pytest.approx(exact * np.array([[1.0], [1.0], [1.02]]))
    late = recorded(KINDS["fourth storey a sample late"], "Kobe", 0.0, 0)
    assert late[[0, 2]] == pytest.approx(exact[[0, 2]])
    assert late[1, 1:] == pytest.approx(exact[1, :-1])
    assert recorded(KINDS["roof a sample early"], "Kobe", 0.0, 0)[2, :-1] == pytest.approx(exact[2, 1:])


def test_noise_has_the_given_share_of_the_channels_root_mean_square() -> None:
    exact, noisy = recorded(IN_CLASS, "Kobe", 0.0, 3), recorded(IN_CLASS, "Kobe", 0.1, 3)
    share = np.std(noisy - exact, axis=1) / np.sqrt(np.mean(exact**2, axis=1))
    assert share == pytest.approx(0.1, rel=0.03)  # six standard errors of a deviation from 18,000 samples
    assert np.corrcoef(noisy - exact) == pytest.approx(np.eye(3), abs=0.03)


@pytest.mark.parametrize("motion", MOTIONS)
def test_cut_records_begin_and_end_in_motion(motion: str) -> None:
    whole, cut = (
        exact_response(IN_CLASS, motion).acceleration[0],
        exact_response(KINDS["cut to its strongest 15 s"], motion),
    )
    base = cut.acceleration[0]
    assert 1500 <= base.size < 3700
    for end in (base[:200], base[-200:]):
        assert end.std() > 0.1 * base.std()
    assert np.sum(base**2) > 0.8 * np.sum(whole**2)


def test_an_estimator_is_reported_the_design() -> None:
    channels = recorded(KINDS["all masses ±20 %"], "Kobe", 0.01, 1)
    reported = estimator_input(as_prepared(channels))
    assert reported.base_mass == BUILDING.base_mass
    assert reported.floor_mass is BUILDING.floor_mass
    assert reported.storey_stiffness is None
