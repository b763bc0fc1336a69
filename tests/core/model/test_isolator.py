import numpy as np
import pytest

from core import paper
from core.errors import ModelError
from core.model.force_response import force_history
from core.model.isolator import Conditions, Isolator


def test_a_linear_layer_is_its_spring_and_dashpot() -> None:
    u, v = np.linspace(-1, 1, 40), np.linspace(3, -2, 40)
    layer = Isolator({"elastic": {"k_b": 2e6}, "viscous": {"c_b": 3e5}})
    assert force_history(layer, u, v, 100.0) == pytest.approx(2e6 * u + 3e5 * v)


def test_hysteresis_is_bounded_and_yields_at_its_force() -> None:
    """Wen (1976): with A = β + γ the force tends to F_y under monotonic loading, and never passes it."""
    u = np.linspace(0, 0.05, 2000)
    hysteresis = Isolator({"bouc_wen": paper.ISOLATOR.effects["bouc_wen"]})
    force = force_history(hysteresis, u, np.full(u.size, 0.05 * 100 / 19.99), 100.0 * 1999 / 1999)
    assert force[-1] == pytest.approx(655.4e3, rel=1e-6)
    assert force.max() <= 655.4e3 * (1 + 1e-9)


def test_monotonic_loading_follows_the_exact_solution() -> None:
    """For n = 1 and A = β + γ = 1, z = 1 - exp(-u / D_y); the method's error at 100 steps per D_y is far below 1e-6."""
    rate, speed = 1000.0, 0.01
    t = np.arange(0.0, 1.0, 1 / rate)
    hysteresis = Isolator({"bouc_wen": paper.ISOLATOR.effects["bouc_wen"]})
    force = force_history(hysteresis, speed * t, np.full(t.size, speed), rate)
    assert force == pytest.approx(655.4e3 * (1 - np.exp(-speed * t / 1.5e-3)), abs=1e-6 * 655.4e3)


def test_usual_conditions_are_dead_load_and_20_degrees() -> None:
    assert Conditions.usual(3, 100.0).rows.tolist() == [[0.0, 0.0, 1.0, 20.0, time, 0.0] for time in (0.0, 0.01, 0.02)]


def test_conditions_of_two_lengths_are_refused() -> None:
    zero = np.zeros(3)
    with pytest.raises(ModelError, match=r"conditions must be alike vectors, got .*'time': \(4,\)"):
        Conditions(zero, zero, zero, zero, np.zeros(4), zero)


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        ({"magic": {}}, "no effect 'magic'; there are .*bouc_wen, .*elastic"),
        ({"elastic": {"k": 1.0}}, r"takes values for \['k_b'\], got \['k'\]"),
        ({"elastic": {"k_b": -1.0}}, "k_b must lie within 0 ... 1e\\+12 N/m, got -1"),
        ({"elastic": {"k_b": float("nan")}}, "got nan"),
    ],
)
def test_refuses_what_is_no_model(effects: dict[str, dict[str, float]], message: str) -> None:
    with pytest.raises(ModelError, match=message):
        Isolator(effects)


def test_refuses_motion_of_two_lengths() -> None:
    with pytest.raises(ModelError, match="must be alike"):
        force_history(paper.ISOLATOR, np.zeros(3), np.zeros(4), 100.0)
