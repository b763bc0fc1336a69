"""The force of a layer in plain Python: laws run as written, states by SciPy's adaptive solver, the motion exact."""

from collections.abc import Iterator, Mapping
from math import prod

import numpy as np
from excitations import swelling_motion, varying_conditions
from scipy.integrate import solve_ivp

from core.arrays import Vector
from core.effect import CHANNELS, KINDS, RESULTS
from core.effects import EFFECTS

Model = Mapping[str, Mapping[str, float]]
STEP = 1e-3
"""s, that laws with corners are given; the solver chooses its own."""


def plain_force(model: Model, times: Vector, seconds: float, amplitude: float, longest_step: float) -> Vector:
    """(n,) N at times of the motion of `exciting.excitation`."""
    keys = [(name, state) for name in model for state in EFFECTS[name].states]

    def rates(t: float, x: Vector) -> list[float]:
        return list(_evaluated(model, t, dict(zip(keys, x, strict=True)), seconds, amplitude)[1].values())

    states = np.zeros((times.size, len(keys)))
    if keys:
        solved = solve_ivp(
            rates,
            (0.0, times[-1]),
            np.zeros(len(keys)),
            "RK45",
            t_eval=times,
            rtol=1e-7,
            atol=1e-9,
            max_step=longest_step,
        )
        states = solved.y.T
    at = [dict(zip(keys, x, strict=True)) for x in states]
    forces = [_evaluated(model, t, x, seconds, amplitude)[0] for t, x in zip(times, at, strict=True)]
    return np.array(forces)


def _evaluated(
    model: Model, t: float, states: Mapping[tuple[str, str], float], seconds: float, amplitude: float
) -> tuple[float, dict[tuple[str, str], float]]:
    """Force, and the rate of every state in the order given."""
    offer = {name: channel.neutral for name, channel in CHANNELS.items()} | dict(_motion(t, seconds, amplitude))
    offer["step"] = STEP
    offer["yielded"] = sum(x for (name, state), x in states.items() if EFFECTS[name].publishes == state)
    rate = dict.fromkeys(states, 0.0)
    for name in sorted(model, key=lambda one: EFFECTS[one].acts_on in RESULTS):
        effect = EFFECTS[name]
        own = {state: states[name, state] for state in effect.states}
        printed = effect.law(*((offer | own | dict(model[name]))[need] for need in effect.needs))
        done, *slopes = printed if isinstance(printed, tuple) else (printed,)
        done *= prod(offer[scale] for scale in KINDS.get(effect.kind or "", ()))
        offer[effect.acts_on] = (
            offer[effect.acts_on] * done if CHANNELS[effect.acts_on].neutral else offer[effect.acts_on] + done
        )
        rate |= {(name, state): slope for state, slope in zip(effect.states, slopes, strict=True)}
    return offer["force"] + offer["inertance"] * _acceleration(t, seconds, amplitude), rate


def _acceleration(t: float, seconds: float, amplitude: float) -> float:
    around = np.array([-1e-4, 1e-4])
    return float(np.diff(swelling_motion(t + around, seconds, amplitude)[1])[0] / np.ptp(around))


def _motion(t: float, seconds: float, amplitude: float) -> Iterator[tuple[str, float]]:
    u, v = swelling_motion(t, seconds, amplitude)
    yield from (("u", float(u)), ("v", float(v)))
    yield from ((name, float(value)) for name, value in varying_conditions(t, seconds, amplitude).items())
