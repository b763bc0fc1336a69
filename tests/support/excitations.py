"""A motion that excites every effect of the isolation layer, and a layer for effects to act on."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from core.arrays import Vector
from core.effect import RESULTS
from core.effects import EFFECTS
from core.model.force_response import force_history
from core.model.isolator import Conditions, Isolator

LAYER: Mapping[str, Mapping[str, float]] = {
    "elastic": {"k_b": 475e6},
    "viscous": {"c_b": 6e6},
    "bouc_wen": {"F_y": 4e6, "D_y": 5e-3, "A": 1.0, "beta": 0.6, "gamma": 0.4, "n": 1.0},
}
"""The isolation layer of a building of 24,000 t."""
TURN = 2 * np.pi * 0.7
"""rad/s."""


@dataclass(frozen=True, slots=True, eq=False)
class Excitation:
    """Motion of the layer, and what acts on it besides."""

    rate: float
    displacement: Vector
    velocity: Vector
    conditions: Conditions


def excitation(rate: float, seconds: float = 8.0, amplitude: float = 0.25) -> Excitation:
    """Swells and fades within the seconds, in both directions, while load and temperature change and time goes on."""
    t = np.arange(0.0, seconds, 1 / rate)
    u, v = swelling_motion(t, seconds, amplitude)
    return Excitation(rate, u, v, Conditions(**varying_conditions(t, seconds, amplitude)))


def swelling_motion(
    t: Vector | float, seconds: float, amplitude: float, phase: float = 0.0
) -> tuple[Vector | float, Vector | float]:
    """m, m/s at times of s: a sine that begins and ends at rest."""
    envelope, growth = np.sin(np.pi * t / seconds) ** 2, np.pi / seconds * np.sin(2 * np.pi * t / seconds)
    wave, slope = np.sin(TURN * t + phase), TURN * np.cos(TURN * t + phase)
    return amplitude * envelope * wave, amplitude * (growth * wave + envelope * slope)


def varying_conditions(t: Vector | float, seconds: float, amplitude: float) -> dict[str, Vector | float]:
    """The other direction in another phase, the vertical load by ± 20 %, a thaw from 5 to 35 °C, and shaking ground."""
    u_cross, v_cross = swelling_motion(t, seconds, 0.6 * amplitude, phase=1.0)
    load, temperature = 1 + 0.2 * np.sin(4 * TURN * t), 20.0 - 15.0 * np.cos(np.pi * t / seconds)
    ground = 2.0 * np.sin(np.pi * t / seconds) ** 2 * np.sin(1.7 * TURN * t)
    return {
        "u_cross": u_cross,
        "v_cross": v_cross,
        "axial_load": load,
        "temperature": temperature,
        "time": t,
        "ground": ground,
    }


def equal_cycles(rate: float, count: int, amplitude: float = 0.25) -> Excitation:
    """Equal cycles under usual conditions."""
    t = np.arange(round(count * 2 * np.pi / TURN * rate)) / rate
    u, v = amplitude * np.sin(TURN * t), amplitude * TURN * np.cos(TURN * t)
    return Excitation(rate, u, v, Conditions.usual(t.size, rate))


def usual_values(name: str, **instead: float) -> dict[str, float]:
    """An effect's usual values, but for those given."""
    return {parameter.name: parameter.prior.median for parameter in EFFECTS[name].parameters} | instead


def required_effects(name: str) -> Mapping[str, Mapping[str, float]]:
    """Effects that an effect needs: a layer if it acts on one, or none."""
    return LAYER if EFFECTS[name].acts_on not in RESULTS else {}


def layer_force(effects: Mapping[str, Mapping[str, float]], given: Excitation) -> Vector:
    """(n,) N."""
    return force_history(Isolator(effects), given.displacement, given.velocity, given.rate, given.conditions)
