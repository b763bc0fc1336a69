"""Compiled integration loops of the force response to a prescribed motion."""

from functools import lru_cache
from typing import Any

from core.code_generation.compilation import UNCOUNTED, bound, cached, inlined
from core.effects import Laws
from core.model.program import MOST_CACHED, force_digest, force_program, tangent_digest, tangent_program


@lru_cache(MOST_CACHED)
def force_kernel(laws: Laws) -> Any:  # noqa: ANN401  numba's functions have no type
    """Kernel of _follow; compiled at its first call."""
    at = inlined(bound(_force_at, program=force_program(laws)))
    return cached(bound(_follow, at=at, motion_at=inlined(_motion_at)), force_digest(laws), UNCOUNTED)


@lru_cache(MOST_CACHED)
def tangent_kernel(laws: Laws) -> Any:  # noqa: ANN401  numba's functions have no type
    """Kernel of _change; compiled at its first call."""
    at = inlined(bound(_tangent_at, program=tangent_program(laws)))
    return cached(bound(_change, at=at, motion_at=inlined(_motion_at)), tangent_digest(laws), UNCOUNTED)


program: Any = None
at: Any = None
motion_at: Any = None
"""Placeholders of the functions that are bound before compilation."""
TOLERANCE = 3e-3
"""Largest difference between the two slopes in the middle of a step, times the step, relative to the largest value that
the state has had. A choice."""
END_TOLERANCE = 0.03
"""The same for the difference between the sum of the slopes at the ends and the sum of those in the middle. A
choice."""


def _force_at(m, step, opcode, at_p, at_x, p, x, dx):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    return program(m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], step, opcode, at_p, at_x, p, x, dx)


def _tangent_at(m, step, opcode, at_p, at_x, p, change_of_p, behind, x, dx):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    return program(
        m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], step, opcode, at_p, at_x, p, change_of_p, behind, x, dx
    )


def _motion_at(samples, weights, i, place):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Motion and conditions at one of the places between two samples for which there are weights.

    As numbers they stay in registers; an array took 5 % longer. At the ends they are those of the samples.
    """
    a, b, c, d, w = samples[i], samples[i + 1], samples[i + 2], samples[i + 3], weights[place]
    if place == 0:
        now = b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]
    elif place == weights.shape[0] - 1:
        now = c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7]
    else:
        now = (
            (w[0] * a[0] + w[3] * d[0]) + (w[1] * b[0] + w[2] * c[0]),
            (w[0] * a[1] + w[3] * d[1]) + (w[1] * b[1] + w[2] * c[1]),
            (w[0] * a[2] + w[3] * d[2]) + (w[1] * b[2] + w[2] * c[2]),
            (w[0] * a[3] + w[3] * d[3]) + (w[1] * b[3] + w[2] * c[3]),
            (w[0] * a[4] + w[3] * d[4]) + (w[1] * b[4] + w[2] * c[4]),
            (w[0] * a[5] + w[3] * d[5]) + (w[1] * b[5] + w[2] * c[5]),
            (w[0] * a[6] + w[3] * d[6]) + (w[1] * b[6] + w[2] * c[6]),
            (w[0] * a[7] + w[3] * d[7]) + (w[1] * b[7] + w[2] * c[7]),
        )
    return now


def _follow(excited, model, start, force, states, steps, room):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Fill in force, states and steps at every sample, by the classical Runge-Kutta method in adaptive steps.

    An interval between samples has at least `least` steps. The number is doubled until the slopes in each step satisfy
    TOLERANCE and END_TOLERANCE. Where the motion reverses, laws have their kinks, and the interval has the largest
    number for which `weights` has points. `samples` start one before the first; a row of `weights` combines four
    neighbouring samples into a point between the middle two. `force` is (n,), `states` is (n, m), `steps` is (n,) and
    `room` is (7, m).
    """
    samples, acceleration, weights, interval, least = excited
    opcode, at_p, at_x, p = model
    n, size, finest = acceleration.size, start.size, weights.shape[0] // 2
    x, dx, stage, end = room[0], room[1], room[2], room[3]
    middle, bend, largest = room[4], room[5], room[6]
    now = motion_at(samples, weights, 0, 0)
    for j in range(size):
        x[j], dx[j], largest[j] = start[j], 0.0, abs(start[j])
    parts = least
    for i in range(n):
        parts = finest if samples[i + 1, 1] * samples[i + 2, 1] < 0 else max(least, parts // 2)
        s = 0
        while s < parts:
            step, stride = interval / parts, finest // parts
            is_rough = False
            for j in range(size):
                end[j] = x[j]
                bend[j] = 0.0
            for k in range(4):
                if k != 2:
                    now = motion_at(samples, weights, i, stride * (2 * s + (k + 1) // 2))
                for j in range(size):
                    stage[j] = x[j] if k == 0 else x[j] + (step if k == 3 else step / 2) * dx[j]
                answer = at(now, step, opcode, at_p, at_x, p, stage, dx)
                if s == 0 and k == 0:
                    force[i] = answer[0] + answer[1] * acceleration[i]
                    for j in range(size):
                        states[i, j] = x[j]
                if size == 0 or i + 1 == n:
                    break
                for j in range(size):
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
        steps[i] = parts
        for j in range(size):
            largest[j] = max(largest[j], abs(x[j]))


def _change(excited, model, directions, moving, states, steps, by_force, by_states, room):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Fill in the changes of force and states along directions, in the steps by which the states were integrated.

    `directions` is (d, parameters), `states` is (n, m) and `steps` is (n,) as _follow fills them in. `by_force` is
    (d, n). `by_states` is (d * m,), the changes of the states at the first sample on entry and at the last one on
    return. Where `moving` is false, no state changes. `room` is (4, (d + 1) * m).
    """
    samples, acceleration, weights, interval, _ = excited
    opcode, at_p, at_x, p = model
    n, m, finest = acceleration.size, states.shape[1], weights.shape[0] // 2
    size = room.shape[1]
    x, dx, stage, end = room[0], room[1], room[2], room[3]
    now = motion_at(samples, weights, 0, 0)
    for j in range(m, size):
        x[j], dx[j] = by_states[j - m], 0.0
    for i in range(n):
        parts = steps[i]
        step, stride = interval / parts, finest // parts
        for j in range(m):
            x[j] = states[i, j]
        for s in range(parts):
            for j in range(size):
                end[j] = x[j]
            for k in range(4):
                if k != 2:
                    now = motion_at(samples, weights, i, stride * (2 * s + (k + 1) // 2))
                for j in range(size):
                    stage[j] = x[j] if k == 0 else x[j] + (step if k == 3 else step / 2) * dx[j]
                answer = at(now, step, opcode, at_p, at_x, p, directions, m, stage, dx)
                if s == 0 and k == 0:
                    for d in range(directions.shape[0]):
                        by_force[d, i] = answer[d + 1][0] + answer[d + 1][1] * acceleration[i]
                if not moving or i + 1 == n:
                    break
                for j in range(size):
                    end[j] += step * (1 / 6 if k % 3 == 0 else 1 / 3) * dx[j]
            if not moving or i + 1 == n:
                break
            for j in range(size):
                x[j] = end[j]
    for j in range(m, size):
        by_states[j - m] = x[j]
