"""Other published forms of the laws, against their exact solutions on a way at constant speed."""

from dataclasses import replace

import numpy as np
import pytest
from excitations import LAYER, Excitation, layer_force, usual_values

from core.arrays import Vector
from core.effects import EFFECTS
from core.model.isolator import Conditions

YIELD = {"bouc_wen": {**LAYER["bouc_wen"], "F_y": 1.0}}
RATE = 200.0
SPEED = 0.1
"""m/s."""


def way(seconds: float, back: float = 0.0) -> Excitation:
    """Out at a constant speed, and back for some seconds."""
    v = SPEED * np.concatenate([np.ones(round(seconds * RATE)), -np.ones(round(back * RATE))])
    u = np.concatenate([[0.0], np.cumsum(v)[:-1]]) / RATE
    return Excitation(RATE, u, v, Conditions.usual(v.size, RATE))


@pytest.mark.parametrize("form", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("effect", ["heating", "biaxial_heating"])
def test_the_core_weakens_inversely_with_the_heat(effect: str, form: float) -> None:
    """(1 + form x)^(-1 / form), x = loss u τ (1 - exp(-t / τ)) / t; 1 %: the travel before it yields."""
    given = way(20.0)
    values = usual_values(effect, loss=2.0, recovery=15.0, form=form)
    t = given.conditions.time
    warming = 2.0 * SPEED * 15.0 * -np.expm1(-t / 15.0)
    late = t > 5.0
    force = layer_force({**YIELD, effect: values}, given)
    assert force[late] == pytest.approx(((1 + form * warming) ** (-1 / form))[late], rel=1e-2)


@pytest.mark.parametrize("v_s", [0.02, 0.2])
def test_the_excess_falls_as_hess_and_soom_measured(v_s: float) -> None:
    """1 / (1 + (v / v_s)²), once the slip is over."""
    force = layer_force({"breakaway": usual_values("breakaway", excess=1.0, v_s=v_s, form=1.0)}, way(1.0))
    assert force[-1] == pytest.approx(1 / (1 + (SPEED / v_s) ** 2), rel=1e-6)


@pytest.mark.parametrize("power", [1.0, 2.0, 3.0])
def test_the_damping_grows_with_a_power_of_the_displacement(power: float) -> None:
    given = way(2.0)
    force = layer_force({"displacement_damping": usual_values("displacement_damping", c_2=1.0, power=power)}, given)
    assert force == pytest.approx(0.1**2 * (given.displacement / 0.1) ** power * SPEED, rel=1e-6, abs=1e-12)


def unloaded(name: str, values: dict[str, float]) -> tuple[Vector, Vector, float]:
    """Force on the way back, after its first two samples, the travel since the second, and the force there."""
    given = way(0.06, back=0.05)
    force, turn = layer_force({name: usual_values(name, **values)}, given), round(0.06 * RATE)
    first, back = float(force[turn + 1]), force[turn + 2 :]
    return back, SPEED / RATE * np.arange(1, back.size + 1), first


def test_unloading_is_as_steep_as_dahl_has_it() -> None:
    """z' = 1 + z on the way back (Dahl, 1968, with an exponent of 1): z = (1 + z₀) exp(-s / D) - 1."""
    D = 0.02
    back, s, first = unloaded("second_hysteresis", {"F_2": 1.0, "D_2": D, "unloading": 1.0})
    assert back == pytest.approx((1 + first) * np.exp(-s / D) - 1, abs=1e-4)


def test_a_slip_is_as_dahl_has_it() -> None:
    """z' = 1 - z out and 1 + z back, as above, times the excess at that speed."""
    D, at_speed = 0.002, np.exp(-((SPEED / 0.2) ** 2))
    values = {"excess": 1.0, "v_s": 0.2, "slip": D, "direct": 1.0}
    back, s, first = unloaded("breakaway", values)
    assert first < 0.9 * at_speed
    assert back == pytest.approx(at_speed * ((1 + first / at_speed) * np.exp(-s / D) - 1), abs=2e-3)


@pytest.mark.parametrize("sticking", [0.2, 0.5])
def test_friction_sticks_as_canudas_de_wit_has_it(sticking: float) -> None:
    """z' = 1 ∓ z / b, b = 1 + sticking exp(-(a v)²), whatever b the first slope is 1 / D; 5e-3: the share of 1e-3."""
    D, a = 0.004, 8.0
    values = {"sliding": 1.0, "share": 1e-3, "a": a, "slip": D, "corner": 1.0, "sticking": sticking, "unloading": 1.0}
    bound = 1 + sticking * np.exp(-((a * SPEED) ** 2))
    out = layer_force({"friction": usual_values("friction", **values)}, way(1.0))
    assert out == pytest.approx(-bound * np.expm1(-SPEED * np.arange(out.size) / RATE / (D * bound)), abs=5e-3)
    back, s, first = unloaded("friction", values)
    assert first < 0.9 * bound
    assert back == pytest.approx((bound + first) * np.exp(-s / (D * bound)) - bound, abs=5e-3)


def test_unloading_is_as_steep_as_ozdemir_has_it() -> None:
    """z' = 1 + z² on the way back with an exponent of 2: z = tan(atan(z₀) - s / D) while it is positive."""
    D = 0.01
    back, s, first = unloaded("sharp_hysteresis", {"F_p": 1.0, "D_p": D, "n_p": 2.0, "unloading": 1.0})
    positive = s < D * np.arctan(first)
    assert positive.sum() > 5
    assert back[positive] == pytest.approx(np.tan(np.arctan(first) - s[positive] / D), abs=1e-3)


@pytest.mark.parametrize("across", [0.05, 0.1, -0.3])
def test_yielding_on_a_circle_has_its_strength_along_the_motion(across: float) -> None:
    """Casciati (1989): at constant speeds the two variables tend to the direction of the motion, on the unit circle."""
    given = way(3.0)
    t = given.conditions.time
    moving = replace(given.conditions, u_cross=across * t, v_cross=np.full(t.size, across))
    values = usual_values("biaxial", joined=1.0, D_cross=YIELD["bouc_wen"]["D_y"], circle=1.0)
    force = layer_force({**YIELD, "biaxial": values}, replace(given, conditions=moving))
    assert force[-1] == pytest.approx(SPEED / np.hypot(SPEED, across), rel=1e-4)


def test_a_fluid_is_linear_at_low_speed() -> None:
    """Carreau (1972): (1 + (v / v₀)²)^((α - 1) / 2) times the viscosity at rest; the force at 0.1 m/s as without."""
    values = usual_values("power_viscous", force=1.0, exponent=0.3, speed=0.1, linear=0.2)
    given = way(1.0)
    for ratio in (1.0, 0.5, 0.02):
        force = layer_force({"power_viscous": values}, replace(given, velocity=ratio * given.velocity))
        shear = ((1 + (ratio / 0.2) ** 2) / (1 + (1 / 0.2) ** 2)) ** (0.5 * (0.3 - 1))
        assert force[-1] == pytest.approx(ratio * shear, rel=1e-9)


@pytest.mark.parametrize("effect", [name for name, one in EFFECTS.items() if one.forms])
def test_the_usual_form_is_none_of_the_others(effect: str) -> None:
    for name, others in EFFECTS[effect].forms.items():
        about = next(one for one in EFFECTS[effect].parameters if one.name == name)
        assert about.prior.median not in others
        assert all(about.bounds[0] <= one <= about.bounds[1] for one in others)
