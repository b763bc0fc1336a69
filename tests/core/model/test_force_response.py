"""Force response to a prescribed motion, its derivatives and its states, against solvers, differences and itself."""

from collections.abc import Callable, Mapping
from time import thread_time

import numpy as np
import pytest
from excitations import excitation, required_effects, usual_values
from scipy.integrate import solve_ivp

from core import paper
from core.arrays import Vector
from core.effects import EFFECTS
from core.errors import ModelError
from core.model.force_response import force_response
from core.model.isolator import Conditions, Isolator, carried, state_names
from core.model.simulation import simulate

RATE = 100.0
Values = Mapping[str, Mapping[str, float]]


def motion(rate: float, seconds: float = 8.0, amplitude: float = 0.03) -> tuple[Vector, Vector]:
    """m, m/s: a sine that grows and fades."""
    given = excitation(rate, seconds, amplitude)
    return given.displacement, given.velocity


def relative(of: Vector, truth: Vector) -> float:
    return float(np.linalg.norm(of - truth) / np.linalg.norm(truth))


def test_agrees_with_an_adaptive_solver() -> None:
    """The paper's layer written down again, LSODA, the motion exact; 1e-4: cubic motion between samples, and kinks."""
    u, v = motion(RATE)
    t, fine = np.arange(u.size) / RATE, np.arange(50 * u.size) / (50 * RATE)
    velocity = motion(50 * RATE)[1]

    def rate(at: float, z: Vector) -> Vector:
        speed = np.interp(at, fine, velocity)
        return (speed - (0.4 * np.sign(z * speed) + 0.6) * abs(z) * speed) / 1.5e-3

    z = solve_ivp(rate, (0, t[-1]), [0.0], "LSODA", t, rtol=1e-9, atol=1e-11, max_step=1e-3).y[0]
    truth = 475e6 * u + 6e6 * v + 655.4e3 * z
    assert relative(force_response(paper.ISOLATOR, u, v, RATE).force, truth) <= 1e-4


@pytest.mark.parametrize(("peak", "yield_at"), [(0.15, 1.5e-3), (0.7, 1.5e-3), (1.8, 4e-3), (1.8, 8e-3)])
def test_one_step_per_sample_at_100_hz_is_right_to_1e_4(peak: float, yield_at: float) -> None:
    """Error over the force's rms, for a building's response to ground motions that move the layer by 4 to 80 mm; seed
    5."""
    rng, t = np.random.default_rng(5), np.arange(0.0, 60.0, 1 / RATE)
    waves = sum(
        rng.standard_normal() * np.sin(2 * np.pi * f * t + rng.uniform(0, 6)) / f**0.5
        for f in np.linspace(0.2, 12, 120)
    )
    ground = waves * np.sin(np.pi * t / 60) ** 2
    hysteresis = {**paper.ISOLATOR.effects["bouc_wen"], "F_y": 1e9 * yield_at, "D_y": yield_at}
    layer = Isolator({**paper.ISOLATOR.effects, "bouc_wen": hysteresis})
    fine = np.interp(np.arange((t.size - 1) * 20 + 1) / (20 * RATE), t, peak * ground / abs(ground).max())
    response = simulate(paper.BUILDING, layer, fine, 20 * RATE)
    u, v, force = (one[::20] for one in (response.isolator_displacement, response.isolator_velocity, response.force))
    assert relative(force_response(layer, u, v, RATE, substeps=1).force, force) <= 1e-4


def test_order_of_convergence() -> None:
    """In the samples' distance: four where laws are smooth, for so is a step's middle; the states' kinks leave two."""
    smooth: Values = {"maxwell": usual_values("maxwell")}
    for effects, order, finest in ((smooth, 3.5, 5.0), (paper.ISOLATOR.effects, 1.5, 5.0)):
        layer, coarse = Isolator(effects), 25.0
        truth = force_response(layer, *motion(64 * coarse), 64 * coarse, substeps=4).force[::64]
        errors = [
            relative(force_response(layer, *motion(n * coarse), n * coarse, substeps=1).force[::n][5:-5], truth[5:-5])
            for n in (2, 8)
        ]
        assert order <= np.log(errors[0] / errors[1]) / np.log(4) <= finest


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_derivatives_are_those_of_what_is_computed(name: str) -> None:
    """By every parameter, states included; steps of 1e-5 leave 1e-7 of the change by rounding, a few samples at kinks
    that pass from one side of a sample to the other more."""
    given, values = excitation(RATE, 4.0), usual_values(name)
    wanted = [(name, parameter) for parameter in values]
    around = {**required_effects(name), name: values}

    def run(instead: Mapping[str, float]) -> Vector:
        layer = Isolator({**around, name: {**values, **instead}})
        return force_response(layer, given.displacement, given.velocity, RATE, conditions=given.conditions).force

    response = force_response(
        Isolator(around), given.displacement, given.velocity, RATE, conditions=given.conditions, wanted=wanted
    )
    assert response.force == pytest.approx(run({}), abs=0)
    for (_, parameter), derivative in zip(wanted, response.by_parameter, strict=True):
        step = 1e-5 * abs(values[parameter] or 1.0)
        slope = (run({parameter: values[parameter] + step}) - run({parameter: values[parameter] - step})) / (2 * step)
        off = np.sort(abs(derivative - slope))[: -slope.size // 100]  # but for one sample in a hundred
        assert abs(derivative).max() > 0, parameter
        assert off.max() <= 1e-4 * abs(slope).max(), parameter


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_no_state_depends_on_what_the_force_is_proportional_to(name: str) -> None:
    """So that such a derivative is the force for one unit of the parameter and nothing of the others."""
    effect, given = EFFECTS[name], excitation(RATE, 4.0)
    if not effect.linear or effect.acts_on != "force":
        return
    values = usual_values(name)
    wanted = [(name, parameter) for parameter in effect.linear]
    arguments = (given.displacement, given.velocity, RATE)
    response = force_response(Isolator({name: values}), *arguments, conditions=given.conditions, wanted=wanted)
    for parameter, column in zip(effect.linear, response.by_parameter, strict=True):
        alone = Isolator({name: {**values, **dict.fromkeys(effect.linear, 0.0), parameter: 1.0}})
        force = force_response(alone, *arguments, conditions=given.conditions).force
        assert column == pytest.approx(force, abs=1e-9 * abs(force).max())


@pytest.mark.parametrize("name", sorted(name for name in EFFECTS if EFFECTS[name].states))
def test_steps_are_as_short_as_a_law_requires(name: str) -> None:
    """Against sixteen a sample; a derivative jumps at reversals, within a step, and a search needs its direction."""
    layer, given = Isolator({**required_effects(name), name: usual_values(name)}), excitation(RATE, 4.0)
    wanted = [(name, parameter) for parameter in usual_values(name)]
    arguments = (given.displacement, given.velocity, RATE)
    response = force_response(layer, *arguments, conditions=given.conditions, wanted=wanted)
    truth = force_response(layer, *arguments, conditions=given.conditions, wanted=wanted, substeps=16)
    assert relative(response.force, truth.force) <= 2e-3
    for ours, theirs in zip(response.by_parameter, truth.by_parameter, strict=True):
        assert relative(ours, theirs) <= 0.1


@pytest.mark.parametrize("name", sorted(name for name in EFFECTS if EFFECTS[name].states))
def test_an_earthquake_in_two_parts_is_the_whole(name: str) -> None:
    """States and their derivatives go on where they stopped; 1e-3: at the cut, neighbours of samples are missing."""
    layer, given, half = Isolator({**required_effects(name), name: usual_values(name)}), excitation(RATE, 4.0), 200
    wanted = [(name, parameter) for parameter in usual_values(name)]

    def part(rows: slice, **start: Vector) -> object:
        conditions = Conditions(*given.conditions.rows[rows].T)
        motion = given.displacement[rows], given.velocity[rows]
        return force_response(layer, *motion, RATE, conditions=conditions, wanted=wanted, substeps=4, **start)

    whole, first = part(slice(None)), part(slice(half + 1))
    second = part(slice(half, None), states=first.states, states_by_parameter=first.states_by_parameter)
    assert second.force[5:] == pytest.approx(whole.force[half + 5 :], abs=1e-3 * abs(whole.force).max())
    for ours, theirs in zip(second.by_parameter[:, 5:], whole.by_parameter[:, half + 5 :], strict=True):
        assert ours == pytest.approx(theirs, abs=2e-3 * abs(theirs).max())


def test_only_what_the_layer_keeps_is_carried_to_the_next_earthquake() -> None:
    layer = Isolator({name: usual_values(name) for name in EFFECTS})
    names = state_names(layer)
    kept = carried(layer, np.ones((2, len(names))))
    assert kept.shape == (2, len(names))
    for (name, state), value in zip(names, kept[1], strict=True):
        assert value == float(state in EFFECTS[name].carried)
    assert 0 < kept.sum() < kept.size


def test_an_inerter_feels_the_velocitys_slope() -> None:
    """Fourth order inside, second at the ends: (ω / rate)^4 / 30 is 1e-9 here, (ω / rate)² / 3 is 1e-4."""
    t, omega = np.arange(400) / RATE, 1.7
    u, v, a = np.sin(omega * t), omega * np.cos(omega * t), -(omega**2) * np.sin(omega * t)
    force = force_response(Isolator({"inerter": {"apparent_mass": 2e6}}), u, v, RATE).force
    assert force[2:-2] == pytest.approx(2e6 * a[2:-2], abs=1e-8 * 2e6 * omega**2)
    assert force == pytest.approx(2e6 * a, abs=1e-3 * 2e6 * omega**2)


@pytest.mark.parametrize(
    ("instead", "message"),
    [
        ({"wanted": [("bouc_wen", "k_b")]}, r"no parameter \('bouc_wen', 'k_b'\); it has .*\('elastic', 'k_b'\)"),
        ({"states": np.zeros(2)}, r"has 1 states and 0 parameters are wanted; the states at the start are \(2,\)"),
        ({"conditions": Conditions.usual(9, RATE)}, r"displacement \(10,\), velocity \(10,\) and conditions \(9,\)"),
    ],
)
def test_refuses_what_does_not_fit(instead: dict[str, object], message: str) -> None:
    with pytest.raises(ModelError, match=message):
        force_response(paper.ISOLATOR, np.zeros(10), np.zeros(10), RATE, **instead)  # type: ignore[arg-type]


def test_derivatives_take_about_as_long_as_the_force() -> None:
    """Four times as long with counted references to arrays in the loop; 2: measured are 1.4 and, of a state-free law's
    parameter, 0.4."""
    u, v = motion(RATE, seconds=60.0)

    def least_time(name: str, wanted: list[tuple[str, str]]) -> float:
        model = Isolator({name: usual_values(name)})
        return shortest(lambda: force_response(model, u, v, RATE, wanted=wanted))

    for name, parameter in (("bouc_wen", "beta"), ("viscous", "c_b")):
        force = least_time(name, [])
        assert least_time(name, [(name, parameter)]) - force < 2 * force


def shortest(work: Callable[[], object]) -> float:
    """s, processor time of the fastest of 20 calls after a first one."""
    work()
    times = []
    for _ in range(20):
        begun = thread_time()
        work()
        times.append(thread_time() - begun)
    return min(times)
