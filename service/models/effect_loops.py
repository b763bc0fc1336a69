"""Loops of an effect at given values, under one motion: for the page of the effect and for the documentation."""

from collections.abc import Mapping

import numpy as np

from core.arrays import Vector
from core.effect import RESULTS, LogNormal, Parameter
from core.effects import EFFECTS, only, process_effects
from core.errors import ModelError
from core.model.force_response import force_history
from core.model.isolator import Conditions, Isolator
from core.units import shown, unit
from service.errors import FieldsError

LAYER = {
    "elastic": {"k_b": 2e7},
    "bouc_wen": {"F_y": 4e6, "D_y": 8e-3, "A": 1.0, "beta": 0.5, "gamma": 0.5, "n": 1.0},
}
"""A layer that mostly yields, so that effects on the yield force show."""
RATE, SECONDS, TURN = 200.0, 7.0, 2 * np.pi * 0.5
"""Hz and s of the motion, and its angular frequency."""
AMPLITUDE = 0.15
"""m, usual."""
LARGEST = 1.0
"""m."""
ALONE, WITHOUT, WITH = "alone", "without", "with"
REACH = 2.5
"""Spreads of the prior on each side of the median that a slider covers. A choice."""


def usual_values(name: str) -> dict[str, float]:
    """Values at which an effect is present, SI units."""
    return {one.name: one.prior.median for one in EFFECTS[name].parameters}


def read_values(name: str, typed: Mapping[str, str]) -> tuple[dict[str, float], float]:
    """Values of the effect's parameters (SI units) and the amplitude (m), from the units that engineers read.

    What is not typed, or is empty, keeps its usual value.

    Raises:
        FieldsError: some are not numbers, or are out of range.
    """
    values, problems = usual_values(name), dict[str, str]()
    for one in EFFECTS[name].parameters:
        low, high = (shown(bound, one.unit) for bound in one.bounds)
        try:
            if given := _number(typed.get(one.name), low, high):
                values[one.name] = min(max(given[0] / shown(1.0, one.unit), one.bounds[0]), one.bounds[1])
        except ValueError as error:
            problems[one.name] = f"{error} {unit(one.unit)}".rstrip()
    amplitude = AMPLITUDE
    try:
        if given := _number(typed.get("amplitude"), 1.0, 1e3 * LARGEST):
            amplitude = given[0] * 1e-3
    except ValueError as error:
        problems["amplitude"] = f"{error} mm"
    if problems:
        raise FieldsError(problems)
    return values, amplitude


def _number(typed: str | None, low: float, high: float) -> tuple[float] | None:
    """The number; None if nothing was typed."""
    if not typed:
        return None
    try:
        value = float(typed[:30])
    except ValueError:
        raise ValueError(f"this must be a number from {low:g} to {high:g}") from None
    if not low <= value <= high:
        raise ValueError(f"this must be from {low:g} to {high:g}")
    return (value,)


def loops(name: str, values: Mapping[str, float], amplitude: float) -> dict[str, tuple[Vector, Vector]]:
    """Displacement (m) and force (N): the layer without and with an effect, and the effect alone if it adds a force.

    The motion grows to the amplitude and decays. The layer also moves in the other direction, the vertical load changes
    by 20 %, and the temperature is 0 °C.

    Raises:
        ModelError: the force grows beyond all bounds at these values.
    """
    others = {other: own for other, own in LAYER.items() if other != name}
    models: dict[str, dict[str, Mapping[str, float]]] = {WITHOUT: {**others}, WITH: {**others, name: values}}
    if EFFECTS[name].acts_on in RESULTS:
        models[ALONE] = {name: values}
    time = np.arange(0.0, SECONDS, 1 / RATE)
    moved, across = _swelling(time, amplitude, 0.0), _swelling(time, 0.6 * amplitude, 1.0)
    velocity, velocity_across = (np.gradient(one, 1 / RATE) for one in (moved, across))
    load = 1 + 0.2 * np.sin(4 * TURN * time)
    ground = np.gradient(_swelling(time, 0.5 * TURN * amplitude, 2.0), 1 / RATE)
    conditions = Conditions(across, velocity_across, load, np.zeros(time.size), time, ground)
    own = process_effects()
    with only(own if name in own else {*LAYER, name}):  # the program of the process is compiled, and few compile fast
        found = {
            way: (moved, force_history(Isolator(effects), moved, velocity, RATE, conditions))
            for way, effects in models.items()
        }
    if not all(np.isfinite(force).all() for _, force in found.values()):
        raise ModelError(f"the force of {name} grows beyond all bounds at these values")
    return found


def _swelling(time: Vector, amplitude: float, phase: float) -> Vector:
    return np.asarray(amplitude * np.sin(np.pi * time / SECONDS) ** 2 * np.sin(TURN * time + phase))


def slider(one: Parameter) -> tuple[float, float, bool]:
    """Ends of a slider in the unit that engineers read, and whether it is logarithmic."""
    low, high = one.bounds
    if isinstance(one.prior, LogNormal):
        ends = one.prior.median * np.exp(-REACH * one.prior.spread), one.prior.median * np.exp(REACH * one.prior.spread)
    else:
        ends = one.prior.median - REACH * one.prior.spread, one.prior.median + REACH * one.prior.spread
    first, last = (shown(float(np.clip(end, low, high)), one.unit) for end in ends)
    return first, last, isinstance(one.prior, LogNormal) and first > 0
