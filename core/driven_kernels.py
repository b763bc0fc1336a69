"""The compiled loops that drive a model along a motion."""

from functools import cache
from typing import Any

import numpy as np

from core.compiled import bound, inlined, jitted, kept
from core.program import force_digest, force_program
from core.tangent_program import tangent_digest, tangent_program


@cache
def force_kernel() -> Any:  # noqa: ANN401  numba's functions have no type
    """See _integrate; compiled when first called."""
    at = inlined(bound(_force_at, program=force_program()))
    return kept(bound(_integrate, at=at), force_digest())


@cache
def tangent_kernel() -> Any:  # noqa: ANN401  numba's functions have no type
    """See _integrate; compiled when first called. States are followed by their changes along the direction."""
    at = inlined(bound(_tangent_at, program=tangent_program()))
    return kept(bound(_integrate, at=at), tangent_digest())


@cache
def column_kernel() -> Any:  # noqa: ANN401  numba's functions have no type
    """See _columns; compiled when first called."""
    at = jitted(bound(_tangent_at, program=tangent_program()))
    return kept(bound(_columns, at=at), tangent_digest())


program: Any = None
at: Any = None
"""Bound when compiled."""


def _force_at(m, opcode, at_p, at_x, p, change_of_p, behind, x, dx):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    force, inertance = program(m[0], m[1], m[2], m[3], m[4], m[5], m[6], opcode, at_p, at_x, p, x, dx)
    return force, inertance, 0.0, 0.0


def _tangent_at(m, opcode, at_p, at_x, p, change_of_p, behind, x, dx):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    return program(m[0], m[1], m[2], m[3], m[4], m[5], m[6], opcode, at_p, at_x, p, change_of_p, behind, x, dx)


def _columns(samples, acceleration, opcode, at_p, at_x, p, directions, states):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Changes of the force along directions on which no state depends: (directions, n) N, from states (n, m)."""
    n, behind = states.shape
    found = np.empty((directions.shape[0], n))
    x, dx = np.zeros(2 * behind), np.zeros(2 * behind)
    for i in range(n):
        for j in range(behind):
            x[j] = states[i, j]
        for k in range(directions.shape[0]):
            answer = at(samples[i + 1], opcode, at_p, at_x, p, directions[k], behind, x, dx)
            found[k, i] = answer[2] + answer[3] * acceleration[i]
    return found


def _integrate(samples, acceleration, weights, step, opcode, at_p, at_x, p, change_of_p, behind, start):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Force, its change and the states at every sample, by the classical Runge-Kutta method.

    `samples` begin one before the first; the row of `weights` for a point between two of them combines four.
    """
    n, substeps = acceleration.size, weights.shape[0] // 2
    ahead, share = (0.0, step / 2, step / 2, step), (step / 6, step / 3, step / 3, step / 6)
    force, change, states = np.empty(n), np.empty(n), np.empty((n, start.size))
    x, dx, stage, end = start.copy(), np.zeros(start.size), np.zeros(start.size), np.zeros(start.size)
    now = np.zeros(samples.shape[1])
    for i in range(n):
        for s in range(substeps):
            for j in range(x.size):
                end[j] = x[j]
            for k in range(4):
                if k != 2:
                    w = weights[2 * s + (k + 1) // 2]
                    for c in range(now.size):
                        now[c] = (w[0] * samples[i, c] + w[3] * samples[i + 3, c]) + (
                            w[1] * samples[i + 1, c] + w[2] * samples[i + 2, c]
                        )
                for j in range(x.size):
                    stage[j] = x[j] + ahead[k] * dx[j]
                answer = at(now, opcode, at_p, at_x, p, change_of_p, behind, stage, dx)
                if s == 0 and k == 0:
                    force[i] = answer[0] + answer[1] * acceleration[i]
                    change[i] = answer[2] + answer[3] * acceleration[i]
                    for j in range(x.size):
                        states[i, j] = x[j]
                if x.size == 0 or i + 1 == n:
                    break
                for j in range(x.size):
                    end[j] += share[k] * dx[j]
            if x.size == 0 or i + 1 == n:
                break
            for j in range(x.size):
                x[j] = end[j]
    return force, change, states
