"""Terms that a sketched law may have: expressions in the motion, its past and the conditions, each of size 1 or less.

A term is written once, as the expression of a law. Its history for a recorded motion is that expression on arrays; the
file of an effect holds the same text. U and V stand for the largest displacement and velocity in the records, {s} for
the term's own length, speed or time.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
import scipy
from numba import njit

from core.arrays import Vector
from core.fitting.observation import Observation

Shape = Literal["length", "speed", "time", "travel", ""]
"""Meaning of a term's own value; empty for none."""

LENGTHS = (0.02, 0.05, 0.1, 0.2, 0.4, 0.7)
"""Shares of the largest displacement where the search begins. A choice: from elastic slip to the largest motion."""
WAVES = tuple(0.02 * 1.12**n for n in range(32))
"""The same for waves, closer: where the phase at the largest displacement is off by half a wave, nothing is left of a
wave. A choice."""
SPEEDS = (0.03, 0.1, 0.3, 0.6)
"""Shares of the largest velocity where the search begins. A choice."""
TIMES = (0.03, 0.08, 0.15, 0.25, 0.4, 0.7, 1.5, 4.0)
"""s, where the search begins. A choice: from delays of a device to twice the period of an isolated building."""
PERIODS = tuple(0.03 * 1.15**n for n in range(24))
"""s over 2π, the same for masses that swing, closer: with a damping ratio of SWINGING a resonance is a tenth of its
frequency wide. A choice: 0.2 to 5 Hz."""
TRAVELS = (2.0, 10.0, 50.0)
"""Travel over the largest displacement where the search begins. A choice."""
FASTEST = 2e-3
"""s, within which no state changes by more than its size: the steps of a simulation could not follow it."""
LAGGING, SWINGING = 0.7, 0.05
"""Damping ratios of a device that follows late, and of one that swings. Choices."""
CATCHING_UP = 2.5e-3
"""s, within which the largest past displacement follows; see core.effects.mullins."""


@dataclass(frozen=True, slots=True)
class Memory:
    """A state of a term: its rates in the law, and its history for a recorded motion."""

    states: tuple[str, ...]
    """Names in the term's expression and in the rates."""
    rates: tuple[str, ...]
    """Their rates per second in the law."""
    history: Callable[[Observation, float, float], Sequence[Vector]]
    """(n,) of the first states in an observation, as many as the expression needs; by {s} and the value before it."""
    is_carried: bool = False
    """True if the layer keeps it from one earthquake to the next."""


@dataclass(frozen=True, slots=True)
class Term:
    """One kind of term."""

    name: str
    """In words."""
    depends: tuple[str, ...]
    """Variables that it depends on."""
    shape: Shape = ""
    starts: tuple[float, ...] = ()
    """Values of {s} where the search begins: lengths and travels over U, speeds over V, times in s."""
    memory: Memory | None = None
    expression: str = field(kw_only=True)
    """Expression of a law, in U, V and {s}."""

    @property
    def meaning(self) -> str:
        """Meaning of its amplitude."""
        return f"force of the {self.name}"


OWN: Mapping[Shape, str] = MappingProxyType(
    {"length": "its own length", "speed": "its own speed", "time": "its own time", "travel": "its own travel"}
)
"""Meaning of a term's own value."""


@njit(cache=False)
def _slipping(u, length, first):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Dahl's variable: exact while the motion between samples has one direction."""
    z = np.empty(u.size)
    z[0] = first
    for i in range(1, u.size):
        step = u[i] - u[i - 1]
        towards = 1.0 if step > 0 else -1.0
        z[i] = towards + (z[i - 1] - towards) * np.exp(-abs(step) / length)
    return z


def _slip(seen: Observation, length: float, first: float) -> Sequence[Vector]:
    return (np.asarray(_slipping(np.ascontiguousarray(seen.layer.displacement), length, first)),)


def _relaxing(seen: Observation, time: float, first: float) -> Sequence[Vector]:
    """A spring in series with a dashpot, its stretch in m; the velocity is constant between samples."""
    u, kept = seen.layer.displacement, float(np.exp(-1 / (seen.rate * time)))
    change = np.diff(u, prepend=u[0]) * (1 - kept) * time * seen.rate
    return (np.asarray(scipy.signal.lfilter([1.0], [1.0, -kept], change)),)


def _filtered(series: Vector, rate: float, upper: Sequence[float], lower: Sequence[float]) -> Vector:
    """(n,) output of a filter with these polynomials in the Laplace variable; the series is linear between samples."""
    above, below, _ = scipy.signal.cont2discrete((upper, lower), 1 / rate, method="foh")
    return np.asarray(scipy.signal.lfilter(above.ravel(), below, series))


def _following(damping: float) -> Callable[[Observation, float, float], Sequence[Vector]]:
    """A spring-mass system that follows the displacement, in m."""

    def history(seen: Observation, time: float, first: float) -> Sequence[Vector]:
        u = seen.layer.displacement
        return (_filtered(u - u[0], seen.rate, [1.0], [time**2, 2 * damping * time, 1.0]) + u[0],)

    return history


def _on_slab(seen: Observation, time: float, first: float) -> Sequence[Vector]:
    """Place (m) and velocity (m/s) relative to the ground of a mass on a spring and a dashpot on the slab."""
    u, ground, late = seen.layer.displacement, seen.conditions.ground, 2 * SWINGING * time
    lower = [time**2, late, 1.0]
    place = _filtered(u - u[0], seen.rate, [late, 1.0], lower) - time**2 * _filtered(ground, seen.rate, [1.0], lower)
    speed = _filtered(u - u[0], seen.rate, [late, 1.0, 0.0], lower)
    return place + u[0], speed - time**2 * _filtered(ground, seen.rate, [1.0, 0.0], lower)


def _largest(seen: Observation, _: float, first: float) -> Sequence[Vector]:
    return (np.maximum(np.maximum.accumulate(np.abs(seen.layer.displacement)), first),)


def _travelled(seen: Observation, _: float, first: float) -> Sequence[Vector]:
    u = seen.layer.displacement
    return (np.asarray(first + np.cumsum(np.abs(np.diff(u, prepend=u[0])))),)


SLIP = Memory(("z",), (f"(v - abs(v) * z) / max({{s}}, {FASTEST:g} * abs(v))",), _slip)
RELAXING = Memory(("stretch",), ("v - stretch / {s}",), _relaxing)
LATE, SWING = (
    Memory(("late", "rate"), ("rate", f"(u - late) / {{s}} ** 2 - {2 * damping:g} * rate / {{s}}"), _following(damping))
    for damping in (LAGGING, SWINGING)
)
ON_SLAB = Memory(
    ("place", "speed"),
    ("speed", f"(u - place + {2 * SWINGING:g} * {{s}} * (v - speed)) / {{s}} ** 2 - ground"),
    _on_slab,
)
LARGEST = Memory(
    ("largest",),
    (f"max(v * copysign(1.0, u) + (abs(u) - largest) / {CATCHING_UP:g}, 0.0)",),
    _largest,
    is_carried=True,
)
TRAVELLED = Memory(("travelled",), ("abs(v)",), _travelled, is_carried=True)

U, V, Z = ("displacement",), ("velocity",), ("yield variable",)
TERMS = (
    Term("spring that hardens or softens with the square", U, expression="u * abs(u) / U ** 2"),
    Term("cubic spring", U, expression="(u / U) ** 3"),
    Term("spring of fifth order", U, expression="(u / U) ** 5"),
    Term("asymmetric spring, by the square", U, expression="(u / U) ** 2"),
    Term("asymmetric spring, stiffer to one side", U, expression="abs(u) / U"),
    Term("spring that saturates", U, "length", LENGTHS, expression="tanh(u / {s})"),
    Term("wave over the displacement", U, "length", WAVES, expression="sin(u / {s})"),
    Term("spring over a range", U, "length", LENGTHS, expression="u / {s} * exp(-0.5 * (u / {s}) ** 2)"),
    Term("spring beyond a gap", U, "length", LENGTHS, expression="copysign(max(abs(u) - {s}, 0.0), u) / U"),
    Term("spring beyond a gap, positive side", U, "length", LENGTHS, expression="max(u - {s}, 0.0) / U"),
    Term("spring beyond a gap, negative side", U, "length", LENGTHS, expression="min(u + {s}, 0.0) / U"),
    Term("quadratic drag", V, expression="v * abs(v) / V ** 2"),
    Term("cubic dashpot", V, expression="(v / V) ** 3"),
    Term("dashpot of the square root", V, expression="copysign(sqrt(abs(v) / V), v)"),
    Term("dashpot that saturates", V, "speed", SPEEDS, expression="tanh(v / {s})"),
    Term("dashpot beyond a speed", V, "speed", SPEEDS, expression="copysign(max(abs(v) - {s}, 0.0), v) / V"),
    Term("dashpot, positive direction", V, expression="max(v, 0.0) / V"),
    Term("dashpot that grows with the displacement", (*U, *V), expression="v * abs(u) / (U * V)"),
    Term("dashpot that grows with its square", (*U, *V), expression="v * u ** 2 / (U ** 2 * V)"),
    Term("dashpot over a range", (*U, *V), "length", LENGTHS, expression="v / V * exp(-0.5 * (u / {s}) ** 2)"),
    Term("dashpot of inward motion", (*U, *V), expression="v / V * (0.5 - 0.5 * copysign(1.0, u * v))"),
    Term("plain slip", Z, "length", LENGTHS, SLIP, expression="z"),
    Term("slip that grows with the displacement", (*U, *Z), "length", LENGTHS, SLIP, expression="z * abs(u) / U"),
    Term("slip that grows with the velocity", (*V, *Z), "length", LENGTHS, SLIP, expression="z * abs(v) / V"),
    Term(
        "slip under the vertical load", (*Z, "axial load"), "length", LENGTHS, SLIP,
        expression="z * (axial_load - 1.0)",
    ),
    Term(
        "slip by temperature", (*Z, "temperature"), "length", LENGTHS, SLIP,
        expression="z * (temperature - 20.0) / 10.0",
    ),
    Term(
        "slip by the other direction", (*Z, "other direction"), "length", LENGTHS, SLIP,
        expression="z * abs(u_cross) / U",
    ),
    Term("spring in series with a dashpot", ("motion before",), "time", TIMES, RELAXING, expression="stretch / U"),
    Term("spring that follows late", ("motion before",), "time", TIMES, LATE, expression="late / U"),
    Term("swinging mass", ("motion before",), "time", TIMES, SWING, expression="late / U"),
    Term(
        "mass that swings on the slab", ("motion before",), "time", PERIODS, ON_SLAB,
        expression=f"(u - place + {2 * SWINGING:g} * {{s}} * (v - speed)) / U",
    ),
    Term(
        "spring that the largest displacement softens", (*U, "largest past displacement"), "length", LENGTHS, LARGEST,
        expression="u / U * exp(-largest / {s})",
    ),
    Term(
        "spring of the largest displacement", (*U, "largest past displacement"), memory=LARGEST,
        expression="u * largest / U ** 2",
    ),
    Term(
        "spring that travel softens", (*U, "travel"), "travel", TRAVELS, TRAVELLED,
        expression="u / U * exp(-travelled / {s})",
    ),
    Term("spring under the vertical load", (*U, "axial load"), expression="u / U * (axial_load - 1.0)"),
    Term("spring by temperature", (*U, "temperature"), expression="u / U * (temperature - 20.0) / 10.0"),
    Term("spring of the other direction", ("other direction",), expression="u_cross / U"),
    Term("spring by the other direction", (*U, "other direction"), expression="u * abs(u_cross) / U ** 2"),
    Term("dashpot of the other direction", ("other direction",), expression="v_cross / V"),
)  # fmt: skip
"""All kinds. Springs and dashpots that are proportional to the motion are left to the model."""

FUNCTIONS: Mapping[str, Callable[..., Any]] = MappingProxyType(
    {
        "abs": np.abs,
        "max": np.maximum,
        "min": np.minimum,
        "exp": np.exp,
        "sin": np.sin,
        "tanh": np.tanh,
        "sqrt": np.sqrt,
        "copysign": np.copysign,
    }
)
"""Functions of expressions, on arrays."""


@dataclass(frozen=True, slots=True)
class Scales:
    """The largest motion in the records, to three digits: the constants of the terms."""

    displacement: float
    """m."""
    velocity: float
    """m/s."""

    def start(self, term: Term, share: float) -> float:
        """{s} in SI units from its share."""
        of = {"length": self.displacement, "travel": self.displacement, "speed": self.velocity}
        return share * of.get(term.shape, 1.0)

    def written(self, text: str) -> str:
        """An expression with the constants in it."""
        return text.replace("U", f"{self.displacement:g}").replace("V", f"{self.velocity:g}")


def scales_of(observations: tuple[Observation, ...]) -> Scales:
    """Scales of records, of which at least one moves."""
    far, fast = (
        max(float(np.abs(getattr(one.layer, name)).max()) for one in observations)
        for name in ("displacement", "velocity")
    )
    return Scales(float(f"{far:.3g}"), float(f"{fast:.3g}"))


def histories(term: Term, s: float, scales: Scales, observations: tuple[Observation, ...]) -> list[Vector]:
    """(n,) values of a term in each observation; these are in order of time.

    Args:
        term: the term.
        s: its own value, SI.
        scales: of the records.
        observations: the records; what the layer keeps passes from each to the next in the same direction.
    """
    compiled = compile(scales.written(term.expression).format(s=repr(s)), "<term>", "eval")
    kept: dict[str, float] = {}
    found = []
    for one in observations:
        given = one.conditions
        names: dict[str, Any] = {
            "u": one.layer.displacement, "v": one.layer.velocity, "u_cross": given.u_cross, "v_cross": given.v_cross,
            "axial_load": given.axial_load, "temperature": given.temperature, "ground": given.ground,
        }  # fmt: skip
        if memory := term.memory:
            first = kept.get(one.direction, 0.0) if memory.is_carried else 0.0
            names.update(zip(memory.states, memory.history(one, s, first), strict=False))
            kept[one.direction] = float(names[memory.states[0]][-1])
        value = eval(compiled, {"__builtins__": {}, **FUNCTIONS}, names)  # of TERMS
        found.append(np.asarray(value, dtype=float) * np.ones(one.layer.displacement.size))
    return found
