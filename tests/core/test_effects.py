"""The contract of every effect: a new file in core/effects is tested by being there."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from excitations import LAYER, Excitation, equal_cycles, excitation, layer_force, required_effects, usual_values
from reference_layer import plain_force

import core.effects
from core.effect import Effect, LogNormal, Parameter
from core.effects import EFFECTS
from core.errors import ModelError
from core.model.force_response import force_response
from core.model.isolator import Conditions, Isolator

every_effect = pytest.mark.parametrize("name", sorted(EFFECTS))
RATE = 200.0
SECONDS, AMPLITUDE = 5.0, 0.25
LESSENS = frozenset({"relief"})
"""Effects that take away from what the layer has: they dissipate only together with it."""
EVEN = frozenset({"asymmetry", "residual_offset"})
"""Effects whose very nature is a difference between the directions."""


@every_effect
def test_no_force_at_rest(name: str) -> None:
    rest = Excitation(RATE, np.zeros(50), np.zeros(50), Conditions.usual(50, RATE))
    assert not layer_force({**required_effects(name), name: usual_values(name)}, rest).any()


@every_effect
def test_absent_effect_does_nothing(name: str) -> None:
    """To the last bit, alone and beside a layer, if the steps are alike: its states may ask for shorter ones."""
    given, absent = excitation(RATE, SECONDS), {name: usual_values(name, **EFFECTS[name].absent)}
    others = {other: values for other, values in LAYER.items() if other != name}
    with_it, without = (
        force_response(
            Isolator(model), given.displacement, given.velocity, RATE, conditions=given.conditions, substeps=3
        ).force
        for model in ({**others, **absent}, others)
    )
    assert not layer_force(absent, given).any()
    assert (with_it == without).all()


@every_effect
def test_every_parameter_changes_the_response(name: str) -> None:
    """By more than a thousandth of what the effect itself does, when it changes by a tenth."""
    given, beside = excitation(RATE, SECONDS), required_effects(name)
    present = layer_force({**beside, name: usual_values(name)}, given)
    without = layer_force(beside, given) if beside else 0.0
    for parameter in EFFECTS[name].parameters:
        prior = parameter.prior
        moved = prior.median * 1.1 if isinstance(prior, LogNormal) else prior.median + 0.1 * prior.spread
        changed = layer_force({**beside, name: usual_values(name, **{parameter.name: moved})}, given)
        assert abs(changed - present).max() > 1e-3 * abs(present - without).max(), parameter.name


@every_effect
def test_steady_cycles_take_energy_from_nothing(name: str) -> None:
    """The work of the last of equal cycles is not negative, beyond the sum's own error of 1e-3."""
    given = equal_cycles(RATE, count=8)
    beside = LAYER if name in LESSENS else required_effects(name)
    power = (layer_force({**beside, name: usual_values(name)}, given) * given.velocity)[-given.velocity.size // 8 :]
    assert power.sum() >= -1e-3 * abs(power).sum()


@every_effect
def test_a_motion_the_other_way_round_has_the_opposite_force(name: str) -> None:
    given, model = excitation(RATE, SECONDS), {**required_effects(name), name: usual_values(name)}
    there = given.conditions
    turned = Excitation(
        RATE,
        -given.displacement,
        -given.velocity,
        replace(there, u_cross=-there.u_cross, v_cross=-there.v_cross, ground=-there.ground),
    )
    forth, back = layer_force(model, given), layer_force(model, turned)
    assert (abs(forth + back).max() < 1e-9 * abs(forth).max()) == (name not in EVEN)


@every_effect
def test_a_change_of_units_changes_the_force_by_its_own(name: str) -> None:
    """Parameters count as their units say. 1 %: a law may have a least time of its own that no unit scales."""
    length, force, time = 3.0, 7.0, 1.5
    size = {"N": force, "m": length, "s": time, "kg": force * time**2 / length, "Hz": 1 / time, "°C": 1.0, "1": 1.0}
    model, given = {**required_effects(name), name: usual_values(name)}, excitation(RATE, SECONDS)
    scaled = {
        effect: {p.name: values[p.name] * _in(p.unit, size) for p in EFFECTS[effect].parameters}
        for effect, values in model.items()
    }
    there = given.conditions
    other = Excitation(
        RATE / time,
        given.displacement * length,
        given.velocity * length / time,
        Conditions(
            there.u_cross * length,
            there.v_cross * length / time,
            there.axial_load,
            there.temperature,
            there.time * time,
            there.ground * length / time**2,
        ),
    )
    expected = force * layer_force(model, given)
    assert np.linalg.norm(layer_force(scaled, other) - expected) < 1e-2 * np.linalg.norm(expected)


@pytest.mark.accuracy
@every_effect
def test_the_compiled_force_agrees_with_plain_python(name: str) -> None:
    """Laws as written, their states by an adaptive solver, the motion exact: left is the line between samples, of
    second order, until 2e-4, where kinks count. The last sample has no neighbour that gives an acceleration."""
    model, coarse = {**required_effects(name), name: usual_values(name)}, 100.0
    times = excitation(coarse, SECONDS).conditions.time
    plain = plain_force(model, times, SECONDS, AMPLITUDE, longest_step=1 / coarse)
    off = [(layer_force(model, excitation(n * coarse, SECONDS))[::n] - plain)[:-1] for n in (1, 4)]
    error = [abs(one).max() / abs(plain).max() for one in off]
    assert error[0] < 5e-3
    assert error[1] < max(error[0] / 8, 2e-4)


def _in(unit: str, size: dict[str, float]) -> float:
    """Size of a unit in units of the given sizes: products by spaces, a quotient, and whole powers."""
    above, _, below = unit.partition("/")
    product = 1.0
    for part, sign in ((above, 1), (below, -1)):
        for factor in part.split():
            symbol, power = re.fullmatch(r"(\D+|1)(?:\^(\d))?", factor).groups()  # type: ignore[union-attr]
            product *= size[symbol] ** (sign * int(power or 1))
    return product


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
    """So that adding an effect is one new file.

    The paper's building, and the layer in which pages show an effect, are examples that may choose theirs.
    """
    root = Path(core.effects.__file__).parents[2]
    sources = [path for package in ("core", "service") for path in (root / package).rglob("*.py")]
    named = [path.relative_to(root).as_posix() for path in sources if f'"{name}"' in path.read_text(encoding="utf-8")]
    assert set(named) <= {"core/paper.py", "service/models/effect_loops.py"}


def test_prior_counts_spreads_from_the_median() -> None:
    assert LogNormal(2.0, 0.5).residual(2.0 * np.exp(0.5)) == pytest.approx(1.0)


PARAMETER = Parameter("a", "1", (0.0, 1.0), LogNormal(0.5, 1.0), "an example")


@pytest.mark.parametrize(
    ("law", "message"),
    [(lambda u, wind: u * wind, r"needs \['wind'\]"), (lambda u, a: u * a, None)],
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
