"""Laws differentiated line by line, against differences of the laws themselves."""

import math
from collections.abc import Callable
from inspect import signature
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from core.code_generation.autodiff import tangent_source
from core.effect import SCALES, YIELDED, Effect
from core.effects import EFFECTS
from core.errors import ModelError

OFFSET = 0.25


def plain(
    law: Callable[..., Any], changing: tuple[str, ...], directions: int = 1
) -> Callable[..., tuple[tuple[float, ...], ...]]:
    """The tangent run as Python, without compiling."""
    namespace: dict[str, Any] = {**law.__globals__, "math": math}
    exec(tangent_source(law, "tangent", changing, directions), namespace)
    tangent: Callable[..., tuple[tuple[float, ...], ...]] = namespace["tangent"]
    return tangent


def smooth(x: float, y: float) -> float:
    """A docstring is no obstacle."""
    a, b = x * y, math.exp(-x)
    a, b = b, a
    total: float = a / (1.0 + y * y) - math.tanh(b) + OFFSET * x**3
    total += math.hypot(x, y) ** 1.5 + math.log1p(x * x) + (1 + x * x) ** y
    return total * math.cos(x) + math.atan(y) * math.sqrt(2.0 + math.sin(x)) + math.copysign(x * x, y) + (+x)


def branching(x: float, y: float) -> tuple[float, float]:
    speed = abs(x)
    if speed > 1.0 and y > 0.0:
        grown = speed * y
    elif speed > 0.5:
        grown = 2.0
    else:
        return max(x, y, 0.3) * min(x, y), -y
    return grown + (x if y < 0.0 else x * y), y / (2.0 + speed)


numbers = st.floats(-3.0, 3.0).filter(lambda x: abs(x) > 1e-2)


@settings(deadline=None, derandomize=True)
@pytest.mark.parametrize("law", [smooth, branching])
@given(x=numbers, y=numbers)
def test_agrees_with_central_differences(law: Callable[..., Any], x: float, y: float) -> None:
    """1e-6 of the values: a step of 1e-6 leaves 1e-10 by rounding and 1e-11 by curvature, times values up to 1e3."""
    step = 1e-6
    gaps = [abs(abs(x) - 1.0), abs(abs(x) - 0.5), abs(x - y), abs(x - 0.3), abs(y - 0.3)]
    if min(gaps) < 1e-4:  # at a kink there are two derivatives
        return
    for direction in ((1.0, 0.0), (0.0, 1.0), (0.6, -0.8)):
        ahead, back = (np.array(law(x + s * direction[0], y + s * direction[1])) for s in (step, -step))
        answer = np.array(plain(law, ("x", "y"))(x, y, *direction))
        assert answer[0] == pytest.approx(np.ravel(law(x, y)), rel=1e-12)
        assert answer[1] == pytest.approx(np.ravel(ahead - back) / (2 * step), rel=1e-6, abs=1e-6)


FARTHEST = {"largest", "ever", "reached", "recent"}
"""States that are a largest displacement, which is never negative."""


def drawn(effect: Effect, rng: np.random.Generator) -> dict[str, float]:
    """Arguments of an effect's law near where it is used."""
    result = {name: rng.uniform(0.5, 1.5) for name in SCALES} | {YIELDED: rng.uniform(-0.9, 0.9)}
    result |= {"u": rng.normal(0, 0.1), "v": rng.normal(0, 0.3), "u_cross": rng.normal(0, 0.1)}
    result |= {"v_cross": rng.normal(0, 0.3), "axial_load": rng.uniform(0.8, 1.2)}
    result |= {"temperature": rng.uniform(-5, 35), "time": rng.uniform(0, 1e8), "ground": rng.normal(0, 2.0)}
    result |= {"step": rng.uniform(1e-3, 1e-2)}
    result |= {state: rng.uniform(-0.3, 0.9) for state in effect.states}
    result |= {state: abs(result[state]) for state in FARTHEST & set(effect.states)}
    return result | {one.name: one.prior.median * rng.uniform(0.8, 1.25) for one in effect.parameters}


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_every_effects_tangent_agrees_with_differences_of_its_law(name: str) -> None:
    """1e-6 of the largest change: steps of 1e-6 of each argument, so that no scale is lost; seed 5."""
    effect, rng = EFFECTS[name], np.random.default_rng(5)
    changing = tuple(
        n for n in effect.needs if n in (*SCALES, YIELDED, *effect.states, *(p.name for p in effect.parameters))
    )
    tangent = plain(effect.law, changing)
    for _ in range(20):
        at = drawn(effect, rng)
        values, step = [at[need] for need in effect.needs], 1e-6
        for along in changing:
            ahead, back = (
                np.ravel(effect.law(*(at[n] * (1 + s) if n == along else at[n] for n in effect.needs)))
                for s in (step, -step)
            )
            answer = np.array(tangent(*values, *(at[n] if n == along else 0.0 for n in changing)))
            size = abs(answer).max()
            assert answer[0] == pytest.approx(np.ravel(effect.law(*values)), rel=1e-12)
            assert answer[1] == pytest.approx((ahead - back) / (2 * step), rel=1e-5, abs=1e-8 * size), along


def powered(x: float, n: float) -> float:
    return x * (1.0 if n == 1.0 else abs(x) ** (n - 1.0))


def powered_by_statement(x: float, n: float) -> float:
    if n != 1.0:  # noqa: SIM108  the statement is what is tested
        bend = abs(x) ** (n - 1.0)
    else:
        bend = 1.0
    return x * bend


@pytest.mark.parametrize("law", [powered, powered_by_statement])
def test_a_shortcut_at_one_point_does_not_hide_the_derivative_there(law: Callable[..., Any]) -> None:
    """x |x|^(n-1) changes with n by x ln|x| at n = 1, though the law never takes a power there."""
    (value,), (change,) = plain(law, ("x", "n"))(0.5, 1.0, 0.0, 1.0)
    assert (value, change) == pytest.approx((0.5, 0.5 * math.log(0.5)))
    assert plain(law, ("x", "n"))(0.0, 1.0, 1.0, 0.0) == ((0.0,), (1.0,))


@pytest.mark.parametrize("law", [smooth, branching, powered, powered_by_statement])
def test_directions_at_once_agree_with_each_alone(law: Callable[..., Any]) -> None:
    """An equality that persists along one direction and not along another decides neither of them."""
    names = tuple(signature(law).parameters)
    one, three = (plain(law, names, number) for number in (1, 3))
    for at in ((0.5, 1.0), (-0.7, 1.0), (0.0, 1.0), (1.5, 2.0), (0.2, -0.4)):
        directions = ((1.0, 0.0), (0.0, 1.0), (0.6, -0.8))
        value, *changes = three(*at, *(part for direction in directions for part in direction))
        for direction, change in zip(directions, changes, strict=True):
            expected, alone = one(*at, *direction)
            assert value == pytest.approx(expected, rel=1e-14)
            assert change == pytest.approx(alone, rel=1e-14)


def looping(x: float) -> float:
    for _ in range(3):
        x = x * x
    return x


def calling(x: float) -> float:
    return np.sinc(x)  # type: ignore[no-any-return]


def taking(x: float) -> float:
    part_1 = x
    return part_1  # noqa: RET504


def remaining(x: float) -> float:
    return x % 2.0


@pytest.mark.parametrize(
    ("law", "message"),
    [
        (
            looping,
            r"test_autodiff.py, line \d+: `for _ in range\(3\):\s.*: a law may contain assignments, `if` and `return`",
        ),
        (calling, r"`np.sinc`: cannot be differentiated; \+ - \* / \*\* and abs, asinh, atan, .* of module math can"),
        (remaining, "`x % 2.0`: cannot be differentiated"),
        (taking, "`part_1`: names that begin with change_of_ or part_ are reserved"),
        (lambda x: x, "is no `def`; write it as one"),
        (math.exp, "the source of the law .* cannot be read; write it as a `def` in a file"),
    ],
)
def test_what_cannot_be_differentiated_is_reported_with_its_line(law: Callable[..., Any], message: str) -> None:
    with pytest.raises(ModelError, match=f"(?s){message}"):
        tangent_source(law, "tangent", ("x",))


def test_the_line_that_is_named_is_the_one_in_the_file() -> None:
    line = remaining.__code__.co_firstlineno + 1
    with pytest.raises(ModelError, match=f"line {line}: `x % 2.0`"):
        tangent_source(remaining, "tangent", ("x",))


def test_what_does_not_change_costs_nothing() -> None:
    assert "change_of_u" not in tangent_source(EFFECTS["elastic"].law, "tangent", ("k_b",))
