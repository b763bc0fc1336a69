"""Compiled integration loops of the force response to a prescribed motion."""

from functools import lru_cache
from typing import Any

from core.code_generation.compilation import UNCOUNTED, bound, cached, inlined
from core.effects import Laws
from core.model.program import MOST_CACHED, force_digest, force_program, tangent_digest, tangent_program


@lru_cache(MOST_CACHED)
def force_kernel(laws: Laws) -> Any:  # noqa: ANN401  numba's functions have no type
    """Kernel of _integrate without derivatives; compiled at its first call."""
    at = inlined(bound(_force_at, program=force_program(laws)))
    return cached(bound(_integrate, at=at), force_digest(laws), UNCOUNTED)


@lru_cache(MOST_CACHED)
def tangent_kernel(laws: Laws) -> Any:  # noqa: ANN401  numba's functions have no type
    """Kernel of _integrate with derivatives, in which changes follow the states; compiled at its first call."""
    at = inlined(bound(_tangent_at, program=tangent_program(laws)))
    return cached(bound(_integrate, at=at), tangent_digest(laws), UNCOUNTED)


@lru_cache(MOST_CACHED)
def column_kernel(laws: Laws) -> Any:  # noqa: ANN401  numba's functions have no type
    """Kernel of _columns; compiled at its first call."""
    at = inlined(bound(_tangent_at, program=tangent_program(laws)))
    return cached(bound(_columns, at=at), tangent_digest(laws), UNCOUNTED)


program: Any = None
at: Any = None
"""Placeholders of the functions that are bound before compilation."""
ANY_STEP = 1e-3
"""s, for a law whose rates are not used."""
TOLERANCE = 3e-3
"""Largest difference between the two slopes in the middle of a step, times the step, relative to the largest value that
the state has had. A choice."""
END_TOLERANCE = 0.03
"""The same for the difference between the sum of the slopes at the ends and the sum of those in the middle. A
choice."""


def _force_at(m, step, opcode, at_p, at_x, p, change_of_p, behind, x, dx):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    force, inertance = program(m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], step, opcode, at_p, at_x, p, x, dx)
    return force, inertance, 0.0, 0.0


def _tangent_at(m, step, opcode, at_p, at_x, p, change_of_p, behind, x, dx):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    return program(
        m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], step, opcode, at_p, at_x, p, change_of_p, behind, x, dx
    )


def _columns(samples, acceleration, opcode, at_p, at_x, p, directions, states, columns, room):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Fill (directions, n) N, changes of the force along directions that affect no state; states is (n, m).

    `room` is (2, 2 m) or wider.
    """
    n, behind = states.shape
    x, dx = room[0], room[1]
    x[:] = 0.0
    for i in range(n):
        for j in range(behind):
            x[j] = states[i, j]
        for k in range(directions.shape[0]):
            answer = at(samples[i + 1], ANY_STEP, opcode, at_p, at_x, p, directions[k], behind, x, dx)
            columns[k, i] = answer[2] + answer[3] * acceleration[i]


def _integrate(excited, model, change_of_p, behind, start, answers, room):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Fill in force, its change and the states at every sample, by the classical Runge-Kutta method in adaptive steps.

    An interval between samples has at least `least` steps. The number is doubled until the slopes in each step satisfy
    TOLERANCE and END_TOLERANCE. Where the motion reverses, laws have their kinks, and the interval has the largest
    number for which `weights` has points. `samples` start one before the first; a row of `weights` combines four
    neighbouring samples into a point between the middle two. `answers` are (n,) force, (n,) change and (n, m) states;
    `room` is (8, the larger of m and the width of `samples`).
    """
    samples, acceleration, weights, interval, least = excited
    opcode, at_p, at_x, p = model
    n, size, finest, judged = acceleration.size, start.size, weights.shape[0] // 2, start.size - behind
    force, change, states = answers
    x, dx, stage, end = room[0], room[1], room[2], room[3]
    middle, bend, largest, now = room[4], room[5], room[6], room[7]
    for j in range(size):
        x[j], dx[j] = start[j], 0.0
    for j in range(judged):
        largest[j] = abs(start[j])
    parts = least
    for i in range(n):
        parts = finest if samples[i + 1, 1] * samples[i + 2, 1] < 0 else max(least, parts // 2)
        s = 0
        while s < parts:
            step, stride = interval / parts, finest // parts
            is_rough = False
            for j in range(size):
                end[j] = x[j]
            for j in range(judged):
                bend[j] = 0.0
            for k in range(4):
                place = stride * (2 * s + (k + 1) // 2)
                if place == 0:
                    for c in range(samples.shape[1]):
                        now[c] = samples[i + 1, c]
                elif place == 2 * finest:
                    for c in range(samples.shape[1]):
                        now[c] = samples[i + 2, c]
                elif k != 2:
                    w = weights[place]
                    for c in range(samples.shape[1]):
                        now[c] = (w[0] * samples[i, c] + w[3] * samples[i + 3, c]) + (
                            w[1] * samples[i + 1, c] + w[2] * samples[i + 2, c]
                        )
                for j in range(size):
                    stage[j] = x[j] if k == 0 else x[j] + (step if k == 3 else step / 2) * dx[j]
                answer = at(now, step, opcode, at_p, at_x, p, change_of_p, behind, stage, dx)
                if s == 0 and k == 0:
                    force[i] = answer[0] + answer[1] * acceleration[i]
                    change[i] = answer[2] + answer[3] * acceleration[i]
                    for j in range(size):
                        states[i, j] = x[j]
                if size == 0 or i + 1 == n:
                    break
                for j in range(judged):
                    bend[j] += dx[j] if k % 3 == 0 else -dx[j]
                    if k == 1:
                        middle[j] = dx[j]
                    # "not at most" rather than "above", for NaN
                    if k == 2 and not step * abs(dx[j] - middle[j]) <= TOLERANCE * largest[j]:
                        is_rough = True
                    if k == 3 and not step * abs(bend[j]) <= END_TOLERANCE * largest[j]:
                        is_rough = True
                if is_rough and parts < finest:
                    break
                for j in range(size):
                    end[j] += step * (1 / 6 if k % 3 == 0 else 1 / 3) * dx[j]
            if size == 0 or i + 1 == n:
                break
            if is_rough and parts < finest:
                parts, s = 2 * parts, 0
                for j in range(size):
                    x[j] = states[i, j]
                continue
            s += 1
            for j in range(size):
                x[j] = end[j]
        for j in range(judged):
            largest[j] = max(largest[j], abs(x[j]))
