"""Response of the building: the isolation layer step by step, implicitly, the superstructure exactly.

The slab's acceleration is assumed linear over a step. The superstructure's oscillators then follow exactly
(Nigam and Jennings, 1969), the layer's laws give their increments, and the slab's equation of motion at the
end of the step is met by turns. Second order.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np
from numba import njit

from core.arrays import Matrix, Vector
from hidden.building import Building
from hidden.catalogue import compiled_laws, law_code
from hidden.law import Law, Step
from hidden.superstructure import oscillators

TURNS = 40
"""At most, of the secant method in each step."""
CLOSE = 1e-10
"""m/s² per m/s²: turns end when the slab's acceleration moves by less."""
KINDS = ("strength", "yielding", "force")
"""Order in which laws are evaluated."""

Hidden = tuple[Law, Mapping[str, float]]
"""A law and its values."""
Cube = np.ndarray[tuple[int, int, int], np.dtype[np.float64]]


@dataclass(frozen=True, slots=True, eq=False)
class Shaking:
    """Ground motion and conditions at the steps of the integration."""

    h: float
    """s, between samples."""
    ground: Matrix
    """(axes, n) m/s², one or two horizontal axes."""
    vertical: Vector
    """(n,) of gravity, upwards."""
    temperature: float
    """°C."""
    time: float
    """s, of the first sample, since the first earthquake began."""


@dataclass(frozen=True, slots=True, eq=False)
class Response:
    """Error-free response of the building at the samples of the ground motion."""

    displacement: Matrix
    """(axes, n) m, of the slab relative to the ground."""
    velocity: Matrix
    """(axes, n) m/s."""
    force: Matrix
    """(axes, n) N, of the isolation layer."""
    acceleration: Cube
    """(axes, 1 + floors, n) m/s², absolute, the base slab first."""
    states: Matrix
    """(axes, states) at the end."""


def simulate_building(
    building: Building, laws: Sequence[Hidden], shaking: Shaking, states: Matrix | None = None
) -> Response:
    """The answer from rest, or from rest with states that the layer kept."""
    ordered = sorted(laws, key=lambda hidden: KINDS.index(hidden[0].kind))
    modes = oscillators(building.superstructure, shaking.h)
    counts = [law.states for law, _ in ordered]
    axes = shaking.ground.shape[0]
    u, v, force, slab, second, end = _kernel()(
        np.array([law_code(law) for law, _ in ordered]),
        np.array([KINDS.index(law.kind) for law, _ in ordered]),
        np.array([law.only_x for law, _ in ordered]),
        np.cumsum([0, *(len(values) for _, values in ordered)]),
        np.array([value for _, values in ordered for value in values.values()]),
        np.cumsum([0, *counts]),
        np.zeros((axes, sum(counts))) if states is None else np.array(states),
        building.superstructure.total_mass,
        modes.participation,
        modes.advance,
        modes.pushed,
        modes.answer,
        np.ascontiguousarray(shaking.ground),
        shaking.vertical,
        np.array([shaking.h, shaking.time, shaking.temperature, building.layer.k, building.layer.c]),
    )
    floors = slab[:, None] + modes.shape @ second
    return Response(u, v, force, np.concatenate([slab[:, None], floors], axis=1), end)


def states_between_events(laws: Sequence[Hidden], states: Matrix, seconds: float) -> Matrix:
    """(axes, states) what of the states at the end of an earthquake is left at the beginning of the next."""
    ordered = sorted(laws, key=lambda hidden: KINDS.index(hidden[0].kind))
    left, place = np.zeros_like(states), 0
    for law, values in ordered:
        for index in law.carried:
            fading = (law.fading or {}).get(index)
            share = 1.0 if fading is None else float(np.exp(-seconds / values[fading]))
            left[:, place + index] = share * states[:, place + index]
        place += law.states
    return left


@cache
def _kernel() -> Any:  # noqa: ANN401  numba's functions have no type
    """The loop over the steps; compiling takes 25 s, so that later processes get it from Numba's cache."""
    found = _bound(_integrate, layer=njit(_bound(_layer, answer=compiled_laws())))
    sources = sorted(Path(__file__).parent.rglob("*.py"))
    digest = sha256(b"\0".join(source.read_bytes() for source in sources)).hexdigest()[:24]
    found.__qualname__ = f"integrate_{digest}"  # names the entry in the cache: it depends on all of the laws' files
    return njit(cache=True)(found)


def _bound(function: FunctionType, **names: Any) -> FunctionType:  # noqa: ANN401  what it calls
    """The function with these global names: Numba caches no closures."""
    made = FunctionType(function.__code__, {**function.__globals__, **names}, function.__name__)
    made.__module__ = function.__module__
    return made


answer: Any = None
layer: Any = None
"""Placeholders of what is bound before compilation."""


def _layer(codes, kinds, only_x, axis, at_p, p, at_s, s, s1, step, past):  # noqa: ANN001, ANN202
    """Force of all laws besides rubber and dashpot, and z at the end of the step."""
    force, strength, z = 0.0, 1.0, 0.0
    for slot in range(codes.size):
        if only_x[slot] and axis > 0:
            continue
        own, new = s[at_s[slot] : at_s[slot + 1]], s1[at_s[slot] : at_s[slot + 1]]
        value = answer(codes[slot], p[at_p[slot] : at_p[slot + 1]], own, new, step, past)
        if kinds[slot] == 0:
            strength *= value
        elif kinds[slot] == 1:
            force += strength * value
            z = new[0]
        else:
            force += value
    return force, z


def _integrate(codes, kinds, only_x, at_p, p, at_s, states, mass, L, advance, pushed, own, ground, vertical, constants):  # noqa: ANN001, ANN202
    axes, n, modes = ground.shape[0], ground.shape[1], L.size
    h, started, temperature, rubber, dashpot = constants[0], constants[1], constants[2], constants[3], constants[4]
    u, v, f, slab = np.zeros((axes, n)), np.zeros((axes, n)), np.zeros((axes, n)), np.zeros((axes, n))
    second = np.zeros((axes, modes, n))
    q, ahead = np.zeros((axes, modes, 2)), np.zeros((axes, modes, 2))
    z0, z, lent, tried, missed = np.zeros(axes), np.zeros(axes), np.zeros(axes), np.zeros(axes), np.zeros(axes)
    s, s1, cross = states, states.copy(), axes - 1.0
    carried = mass  # what of the mass the slab must move at once: the rest hangs on the oscillators
    for j in range(modes):
        carried += L[j] * (own[j, 0] * pushed[j, 0, 1] + own[j, 1] * pushed[j, 1, 1] - L[j])
    for i in range(1, n):
        for x in range(axes):
            before = slab[x, i - 1]
            lent[x] = 0.0
            for j in range(modes):
                for r in range(2):
                    ahead[x, j, r] = (
                        advance[j, r, 0] * q[x, j, 0] + advance[j, r, 1] * q[x, j, 1] + pushed[j, r, 0] * before
                    )
                lent[x] += L[j] * (own[j, 0] * ahead[x, j, 0] + own[j, 1] * ahead[x, j, 1])
            slab[x, i] = 2 * before - slab[x, i - 2] if i > 1 else 0.0
            z0[x] = z[x]
        for turn in range(TURNS):
            moved = 0.0
            for x in range(axes):
                a0, a = slab[x, i - 1] - ground[x, i - 1], slab[x, i] - ground[x, i]
                u[x, i] = u[x, i - 1] + h * v[x, i - 1] + h * h * (a0 / 3 + a / 6)
                v[x, i] = v[x, i - 1] + h * (a0 + a) / 2
            for x in range(axes):
                o = axes - 1 - x
                step = Step(
                    u[x, i - 1], v[x, i - 1], u[x, i], v[x, i], slab[x, i] - ground[x, i],
                    cross * u[o, i - 1], cross * u[o, i], cross * v[o, i],
                    z0[x], z[x], slab[x, i - 1], slab[x, i], vertical[i], temperature, started + i * h, i, h,
                )  # fmt: skip
                hidden, z[x] = layer(codes, kinds, only_x, x, at_p, p, at_s, s[x], s1[x], step, u[x])
                f[x, i] = rubber * u[x, i] + dashpot * v[x, i] + hidden
                miss, slope = slab[x, i] + (f[x, i] + lent[x]) / carried, 1.0
                if turn > 0 and slab[x, i] != tried[x]:
                    slope = max((miss - missed[x]) / (slab[x, i] - tried[x]), 0.5)
                tried[x], missed[x] = slab[x, i], miss
                slab[x, i] -= miss / slope
                moved = max(moved, abs(miss / slope) / (1.0 + abs(miss)))
            if moved < CLOSE:
                break
        for x in range(axes):
            for j in range(modes):
                for r in range(2):
                    q[x, j, r] = ahead[x, j, r] + pushed[j, r, 1] * slab[x, i]
                second[x, j, i] = own[j, 0] * q[x, j, 0] + own[j, 1] * q[x, j, 1] - L[j] * slab[x, i]
            for k in range(s.shape[1]):
                s[x, k] = s1[x, k]
    return u, v, f, slab, second, s
