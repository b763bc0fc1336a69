"""Effects on the yield force: its bound, its sharpness, and the circle that two directions share."""

import numpy as np
import pytest
from excitations import LAYER, Excitation, equal_cycles, excitation, layer_force, usual_values
from hypothesis import given, settings, strategies as st

from core.model.isolator import Conditions

YIELD = {"bouc_wen": {**LAYER["bouc_wen"], "F_y": 1.0}}


@settings(max_examples=60, deadline=None, derandomize=True)
@given(
    times=st.floats(0.4, 12.0),
    D_y=st.floats(1e-3, 2e-2),
    amplitude=st.floats(2e-3, 0.6),
    joined=st.floats(0.0, 2.0),
    z1=st.floats(0.0, 0.98),
)
def test_the_hysteretic_variable_stays_within_its_bound(
    times: float, D_y: float, amplitude: float, joined: float, z1: float
) -> None:
    """|z| <= 1 for A = β + γ (Wen, 1976) however sharp, pinched or coupled; 5 %: what a step at 100 Hz overshoots."""
    model = {
        "bouc_wen": YIELD["bouc_wen"] | {"D_y": D_y},
        "yield_sharpness": {"times": times},
        "biaxial": usual_values("biaxial", joined=joined, D_cross=D_y),
        "pinching": usual_values("pinching", z1=z1),
    }
    assert abs(layer_force(model, excitation(100.0, 4.0, amplitude))).max() < 1.05


def test_a_sharper_yield_nears_the_bilinear_one() -> None:
    """z = u / D_y until it yields and 1 from then on; rms over the first quarter of a cycle."""
    motion = equal_cycles(400.0, count=1, amplitude=0.02)
    quarter = slice(0, motion.velocity.size // 4)
    bilinear = np.minimum(motion.displacement / YIELD["bouc_wen"]["D_y"], 1.0)[quarter]
    off = [
        np.sqrt(np.mean((layer_force({**YIELD, "yield_sharpness": {"times": times}}, motion)[quarter] - bilinear) ** 2))
        for times in (1.0, 3.0, 10.0)
    ]
    assert off[0] > 2 * off[1] > 4 * off[2]


@pytest.mark.parametrize("n_p", [1.0, 2.0, 60.0])
def test_a_second_hysteresis_yields_as_sharply_as_its_exponent_says(n_p: float) -> None:
    """Over one straight way at 0.1 m/s and back to no force, where exact solutions exist: 1 − exp(−u / D), tanh(u / D)
    and, for a large exponent, min(u / D, 1), whose corner an exponent of 60 rounds by up to 4 %; unloading is straight.
    """
    out, D = 0.1 * np.arange(80) / 200.0, 0.01
    u = np.concatenate([out, out[-1] - 0.1 * np.arange(1, 19) / 200.0])
    v = np.concatenate([np.full(out.size, 0.1), np.full(18, -0.1)])
    force = layer_force(
        {"sharp_hysteresis": {"F_p": 1.0, "D_p": D, "n_p": n_p}}, Excitation(200.0, u, v, Conditions.usual(u.size, 200))
    )
    solutions = {1.0: 1 - np.exp(-out / D), 2.0: np.tanh(out / D), 60.0: np.minimum(out / D, 1.0)}
    assert force[: out.size] == pytest.approx(solutions[n_p], abs=0.04 if n_p > 2 else 2e-3)
    back = slice(out.size + 1, -1)  # the motion turns between two samples
    assert np.diff(force[back]) == pytest.approx(np.diff(u[back]) / D, abs=1e-6)


def test_a_sharp_hysteresis_is_an_elastic_plastic_element_in_any_motion() -> None:
    """Exact steps of the displacement, z ← z + Δu / D within ± 1; rms over the yield force."""
    fine, D = excitation(1600.0, 5.0), 0.01
    z = np.zeros(fine.displacement.size)
    for now, travel in enumerate(np.diff(fine.displacement), 1):
        z[now] = np.clip(z[now - 1] + travel / D, -1.0, 1.0)
    off = [
        layer_force({"sharp_hysteresis": {"F_p": 1.0, "D_p": D, "n_p": n_p}}, excitation(100.0, 5.0)) - z[::16]
        for n_p in (2.0, 20.0, 100.0)
    ]
    rms = [float(np.sqrt(np.mean(one[:-1] ** 2))) for one in off]
    assert rms[0] > 8 * rms[1]
    assert rms[1] < 4e-3
    assert rms[2] < 2e-3


def test_motion_in_both_directions_leaves_each_less_than_all_the_strength() -> None:
    """Equal motions, n = 1, λ = 1: at rest of z, 1 - z - z² = 0 (the golden section)."""
    one = equal_cycles(200.0, count=2, amplitude=0.05)
    ramp = 0.2 * np.arange(400) / 200.0
    fast = np.full(400, 0.2)
    both = Conditions(ramp, fast, np.ones(400), np.full(400, 20.0), one.conditions.time[:400], np.zeros(400))
    model = {**YIELD, "biaxial": {"joined": 1.0, "D_cross": YIELD["bouc_wen"]["D_y"]}}
    force = layer_force(model, Excitation(200.0, ramp, fast, both))
    assert force[-1] == pytest.approx((np.sqrt(5) - 1) / 2, rel=1e-6)


def test_the_core_cools_while_at_rest_and_degradation_stays() -> None:
    """After strong motion and a rest of ten times the recovery a small cycle is as high as when new; or not."""
    new, strong = equal_cycles(100.0, count=1, amplitude=0.03), equal_cycles(100.0, count=6, amplitude=0.2)
    rest = np.zeros(2000)
    u, v = (np.concatenate([getattr(strong, name), rest, getattr(new, name)]) for name in ("displacement", "velocity"))
    long = Excitation(100.0, u, v, Conditions.usual(u.size, 100.0))
    height = {}
    for name, values in {"heating": {"loss": 0.2, "recovery": 2.0}, "degradation": {"delta": 0.1}}.items():
        force = layer_force({**YIELD, name: values}, long)[-new.velocity.size :]
        height[name] = abs(force).max() / abs(layer_force({**YIELD, name: values}, new)).max()
    assert height["heating"] == pytest.approx(1.0, abs=1e-2)
    assert height["degradation"] < 0.8
