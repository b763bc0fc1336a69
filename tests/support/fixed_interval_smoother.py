"""The restoring force by a fixed-interval smoother in time: Kalman's filter, then Bryson and Frazier's way back.

Nothing is shared with the product's own but the superstructure's fixed-base modes: the record's ends are an initial
state of no prior, the base slab's acceleration is a random walk from sample to sample, linear between them.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from core.arrays import Indices, Matrix, Vector
from core.estimators.frame.model import Superstructure


@dataclass(frozen=True, slots=True, eq=False)
class StateSpace:
    """States: modal displacements and velocities relative to the base slab, and the base slab's acceleration."""

    step: Matrix
    """(states, states) from a sample to the next."""
    drive: Vector
    """(states,) by the random walk's increment."""
    channels: Matrix
    """(channels, states) base slab and measured floors, absolute accelerations."""
    force: Vector
    """(states,) F = -Σ m_i a_i."""
    first: Vector
    """(states,) initial variance over that of the channels."""


def state_space(structure: Superstructure, measured: Indices, base_mass: float, rate: float) -> StateSpace:
    """State space of the modes, damped as at their own frequencies: a hysteretic part becomes viscous."""
    ω, modes = 2 * np.pi * structure.frequencies, structure.squared.size
    participation = structure.inputs[:, 0]
    own = np.hstack(
        [-np.diag(ω**2), -np.diag(2 * structure.damping_ratios * ω), -participation[:, None]]
    )  # modal accelerations
    # x' = A x + b a with a linear over a step (Van Loan 1978)
    block = np.zeros((2 * modes + 2,) * 2)
    block[:modes, modes : 2 * modes] = np.eye(modes)
    block[modes : 2 * modes, : 2 * modes + 1] = own
    block[2 * modes, 2 * modes + 1] = rate
    whole = expm(block / rate)
    floors = structure.shapes @ own
    floors[:, -1] += 1.0
    base = np.append(np.zeros(2 * modes), 1.0)
    return StateSpace(
        step=whole[: 2 * modes + 1, : 2 * modes + 1],
        drive=np.append(whole[: 2 * modes, 2 * modes + 1], 1.0),
        channels=np.vstack([base, floors[measured]]),
        force=-(base_mass * base + structure.mass @ floors),
        first=100 * np.concatenate([(participation / ω**2) ** 2, (participation / ω) ** 2, [1.0]]),
    )


def smoothed_force(model: StateSpace, channels: Matrix, noise: Vector) -> Vector:
    """(n,) N.

    Args:
        model: of the superstructure.
        channels: (channels, n) m/s², absolute accelerations.
        noise: (channels,) m/s², standard deviation.
    """
    F, H, R = model.step, model.channels, np.diag(noise**2)
    increments = max(float(np.var(np.diff(channels[0]))) - 2 * noise[0] ** 2, noise[0] ** 2 / 100)
    Q = increments * np.outer(model.drive, model.drive)
    x, P = np.zeros(len(F)), np.diag(model.first * np.mean(channels**2))
    count = channels.shape[1]
    states, covariances = np.empty((count, len(F))), np.empty((count, len(F), len(F)))
    kept, weighted = np.empty_like(covariances), np.empty_like(states)
    for k in range(count):
        if k:
            x, P = F @ x, F @ P @ F.T + Q
        S = H @ P @ H.T + R
        innovation = np.linalg.solve(S, channels[:, k] - H @ x)
        gain = np.linalg.solve(S, H @ P).T
        x = x + P @ H.T @ innovation
        kept[k] = np.eye(len(F)) - gain @ H
        P = kept[k] @ P @ kept[k].T + gain @ R @ gain.T
        states[k], covariances[k], weighted[k] = x, P, H.T @ innovation
    adjoint = np.zeros(len(F))
    for k in reversed(range(count)):
        states[k] -= covariances[k] @ adjoint
        adjoint = F.T @ (kept[k].T @ adjoint - weighted[k])
    return np.asarray(states @ model.force)
