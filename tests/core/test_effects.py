"""The contract of every effect: a new file in core/effects is tested by being there."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import core.effects
from core.effect import CHANNELS, MOTION, YIELDED, Effect, LogNormal, Parameter
from core.effects import EFFECTS
from core.errors import ModelError
from core.isolator import Isolator, force_history

every_effect = pytest.mark.parametrize("name", sorted(EFFECTS))
RATE = 200.0


def usual(name: str, **instead: float) -> Isolator:
    values = {parameter.name: parameter.prior.median for parameter in EFFECTS[name].parameters}
    return Isolator({name: {**values, **instead}})


def sweep(amplitude: float = 0.02, seconds: float = 8.0) -> tuple[np.ndarray, np.ndarray]:
    """Displacement (m) and velocity (m/s) of a sine that starts at rest at zero and ends there."""
    t = np.arange(0.0, seconds, 1 / RATE)
    envelope, omega = np.sin(np.pi * t / seconds) ** 2, 2 * np.pi * 0.7
    u = amplitude * envelope * np.sin(omega * t)
    growth = np.pi / seconds * np.sin(2 * np.pi * t / seconds)
    return u, amplitude * (growth * np.sin(omega * t) + envelope * omega * np.cos(omega * t))


@every_effect
def test_no_force_at_rest(name: str) -> None:
    rest = np.zeros(50)
    assert not force_history(usual(name), rest, rest, RATE).any()


@every_effect
def test_absent_effect_does_nothing(name: str) -> None:
    """An effect that adds force adds exactly none; one that scales others leaves them exactly as they were."""
    others = {} if EFFECTS[name].acts_on == "force" else {"elastic": {"k_b": 1e8}}
    absent = Isolator({**others, **usual(name, **EFFECTS[name].absent).effects})
    expected = force_history(Isolator(others), *sweep(), RATE) if others else np.zeros(sweep()[0].size)
    assert (force_history(absent, *sweep(), RATE) == expected).all()


@every_effect
def test_every_parameter_changes_the_response(name: str) -> None:
    for parameter in EFFECTS[name].parameters:
        changed = usual(name, **{parameter.name: 1.1 * parameter.prior.median})
        assert (force_history(changed, *sweep(), RATE) != force_history(usual(name), *sweep(), RATE)).any(), parameter


@every_effect
def test_a_closed_motion_takes_energy_from_nothing(name: str) -> None:
    """The work over a motion that returns to rest is not negative, beyond the sum's own error of 1e-3."""
    u, v = sweep()
    power = force_history(usual(name), u, v, RATE) * v
    assert power.sum() >= -1e-3 * abs(power).sum()


@every_effect
def test_the_compiled_force_agrees_with_plain_python(name: str) -> None:
    """The law run as written, its states by an independent adaptive solver; 1e-4: kinks, and the motion's own linear
    interpolation between samples."""
    effect, (u, v) = EFFECTS[name], sweep()
    values = {parameter.name: parameter.prior.median for parameter in effect.parameters}
    t = np.arange(u.size) / RATE

    def run(at: float, states: np.ndarray) -> list[float]:
        offer = {name: channel.neutral for name, channel in CHANNELS.items()} | dict.fromkeys(MOTION, 0.0)
        offer |= {"axial_load": 1.0, "temperature": 20.0, "time": at} | values
        offer |= {"u": np.interp(at, t, u), "v": np.interp(at, t, v)} | dict(zip(effect.states, states, strict=True))
        offer[YIELDED] = offer[effect.publishes] if effect.publishes else 0.0
        return list(np.atleast_1d(effect.law(*(offer[need] for need in effect.needs))))

    states = np.zeros((len(effect.states), u.size))
    if effect.states:
        start = np.zeros(len(effect.states))
        solved = solve_ivp(
            lambda at, x: run(at, x)[1:], (0, t[-1]), start, t_eval=t, rtol=1e-8, atol=1e-10, max_step=1 / RATE
        )
        states = solved.y
    plain = np.array([run(at, x)[0] for at, x in zip(t, states.T, strict=True)])
    assert force_history(usual(name), u, v, RATE) == pytest.approx(plain, abs=1e-4 * abs(plain).max())


@every_effect
def test_priors_lie_within_bounds_and_absence_too(name: str) -> None:
    bounds = {parameter.name: parameter.bounds for parameter in EFFECTS[name].parameters}
    for parameter in EFFECTS[name].parameters:
        assert parameter.bounds[0] < parameter.prior.median < parameter.bounds[1]
    assert EFFECTS[name].absent
    for key, value in EFFECTS[name].absent.items():
        assert bounds[key][0] <= value <= bounds[key][1]


@every_effect
def test_an_effect_explains_itself_with_its_own_values(name: str) -> None:
    effect = EFFECTS[name]
    values = {parameter.name: parameter.prior.median for parameter in effect.parameters}
    assert "{" not in effect.explanation.format(**values)
    assert all([effect.title, effect.suspect_when, effect.source, *(p.meaning and p.unit for p in effect.parameters)])


@every_effect
def test_nothing_in_core_or_service_but_its_own_file_names_an_effect(name: str) -> None:
    """So that adding an effect is one new file. The paper's building is an example, and may choose its effects."""
    root = Path(core.effects.__file__).parents[2]
    sources = [path for package in ("core", "service") for path in (root / package).rglob("*.py")]
    named = [path.relative_to(root).as_posix() for path in sources if f'"{name}"' in path.read_text(encoding="utf-8")]
    assert set(named) <= {"core/paper.py"}


def test_prior_counts_spreads_from_the_median() -> None:
    assert LogNormal(2.0, 0.5).residual(2.0 * np.exp(0.5)) == pytest.approx(1.0)


PARAMETER = Parameter("a", "1", (0.0, 1.0), LogNormal(0.5, 1.0), "an example")


@pytest.mark.parametrize(
    ("law", "message"),
    [(lambda u, wind: u * wind, r"asks for \['wind'\]"), (lambda u, a: u * a, None)],
)
def test_a_law_may_ask_only_for_what_is_offered(law: object, message: str | None) -> None:
    def make() -> Effect:
        return Effect(
            title="Example",
            law=law,  # type: ignore[arg-type]
            parameters=(PARAMETER,),
            absent={"a": 0.0},
            family="elasticity",
            explanation="",
            suspect_when="",
            source="",
        )

    if message is None:
        assert make().needs == ("u", "a")
    else:
        with pytest.raises(ModelError, match=message):
            make()
