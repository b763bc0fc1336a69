"""The force program and its tangent: all laws compiled into one function each, so that models need no compiling.

A program is generated as plain Python source, one branch per effect, and compiled into the kernels that call it.
Measured alternatives: one compilation per combination of effects takes 1.1 s each; closures run half as fast; channels
in an array instead of local names take two thirds of the time to compile and twice the time to run.

The tangent program has the same shape. It also computes the rates of change along DIRECTIONS directions in the space
of the parameters and states. The changes of a state are stored behind it, at distances of as many entries as there are
states.
"""

import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

from core.code_generation.autodiff import as_tuple, change_of, tangent_source
from core.code_generation.compilation import digest, inlined, jitted
from core.effect import CHANNELS, CONDITIONS, KINDS, MOTION, RESULTS, SCALES, STEP, YIELDED, Effect
from core.effects import Laws

GIVEN = (*MOTION, *CONDITIONS, STEP)
"""Arguments of a program that describe the layer's motion and conditions."""
DIRECTIONS = 2
"""Directions of the tangent program. On 13 models with one to four wanted parameters, derivatives in two directions at
once took 58 % of the time of one after the other; three and four took as much, and up to twice as long to compile."""
MOST_CACHED = 2
"""Sets of laws whose programs a process keeps: after an effect was added, the previous set may still be in use."""


def in_opcode_order(effects: Mapping[str, Effect]) -> tuple[str, ...]:
    """Names of the effects, those that scale others first; the index is the opcode."""
    return tuple(sorted(effects, key=lambda name: (effects[name].acts_on in RESULTS, name)))


def force_program_source(effects: Mapping[str, Effect]) -> str:
    """Source of the force program. Slot s of a model has opcode[s], parameters p[at_p[s]:], states x[at_x[s]:]."""
    lines = [f"def force({', '.join(GIVEN)}, opcode, at_p, at_x, p, x, dx):"]
    lines += [f"    {name} = {channel.neutral}" for name, channel in CHANNELS.items()]
    lines += _published(effects, {YIELDED: ""})
    lines += ["    for s in range(opcode.size):", "        i, j = at_p[s], at_x[s]"]
    for code, name in enumerate(in_opcode_order(effects)):
        lines += [f"        {'elif' if code else 'if'} opcode[s] == {code}:", *_force_branch(name, effects[name])]
    return "\n".join([*lines, f"    return {', '.join(RESULTS)}"])


def tangent_program_source(effects: Mapping[str, Effect]) -> str:
    """Source of the tangent program; the rows of change_of_p are the directions, and the changes of the states along
    the first one are `behind` entries behind them, along the next one twice as many."""
    lines = [f"def tangent({', '.join(GIVEN)}, opcode, at_p, at_x, p, change_of_p, behind, x, dx):"]
    for name, channel in CHANNELS.items():
        lines += [f"    {name} = {channel.neutral}", *(f"    {one} = 0.0" for one in _changes_of(name))]
    offsets = {one: f" + {number} * behind" for number, one in enumerate(_changes_of(YIELDED), 1)}
    lines += _published(effects, {YIELDED: "", **offsets})
    lines += ["    for s in range(opcode.size):", "        i, j = at_p[s], at_x[s]"]
    lines += [f"        j_{number} = j + {number + 1} * behind" for number in range(DIRECTIONS)]
    for code, name in enumerate(in_opcode_order(effects)):
        lines += [f"        {'elif' if code else 'if'} opcode[s] == {code}:", *_tangent_branch(name, effects[name])]
    changes = [as_tuple(change_of(result, number) for result in RESULTS) for number in range(DIRECTIONS)]
    return "\n".join([*lines, f"    return {', '.join([as_tuple(RESULTS), *changes])}"])


def _changes_of(name: str) -> tuple[str, ...]:
    return tuple(change_of(name, number) for number in range(DIRECTIONS))


def compiled_force(effects: Mapping[str, Effect]) -> Callable[..., tuple[float, float]]:
    """The force program, jitted: (u, v, u_cross, ..., opcode, at_p, at_x, p, x, dx) → N, kg; fills dx with rates."""
    namespace: dict[str, Any] = {f"law_{name}": jitted(effect.law) for name, effect in effects.items()}
    exec(force_program_source(effects), namespace)  # the source is ours, made of the laws above
    program: Callable[..., tuple[float, float]] = inlined(namespace["force"])
    return program


def compiled_tangent(effects: Mapping[str, Effect]) -> Callable[..., tuple[tuple[float, float], ...]]:
    """The tangent program, jitted: (u, v, ..., p, change_of_p, behind, x, dx) → results, and their changes."""
    namespace: dict[str, Any] = {f"tangent_{name}": tangent_law(effect) for name, effect in effects.items()}
    exec(tangent_program_source(effects), namespace)  # the source is ours, made of the laws' tangents
    program: Callable[..., tuple[tuple[float, float], ...]] = inlined(namespace["tangent"])
    return program


def tangent_law(effect: Effect) -> Callable[..., tuple[tuple[float, ...], ...]]:
    """Tangent of an effect's law with respect to its states, parameters and the results of other laws, jitted."""
    namespace: dict[str, Any] = {**effect.law.__globals__, "math": math}
    exec(_tangent_law_source(effect), namespace)
    tangent: Callable[..., tuple[tuple[float, ...], ...]] = jitted(namespace["tangent"])
    return tangent


@lru_cache(MOST_CACHED)
def force_program(laws: Laws) -> Callable[..., tuple[float, float]]:
    """Force program of these effects."""
    return compiled_force(dict(laws))


@lru_cache(MOST_CACHED)
def tangent_program(laws: Laws) -> Callable[..., tuple[tuple[float, float], ...]]:
    """Tangent program of these effects."""
    return compiled_tangent(dict(laws))


@lru_cache(MOST_CACHED)
def opcodes(laws: Laws) -> Mapping[str, int]:
    """Opcodes of the effects, by their names."""
    return {name: code for code, name in enumerate(in_opcode_order(dict(laws)))}


@lru_cache(MOST_CACHED)
def force_digest(laws: Laws) -> str:
    """Digest of all sources of the force program."""
    effects = dict(laws)
    return digest(effects, force_program_source(effects))


@lru_cache(MOST_CACHED)
def tangent_digest(laws: Laws) -> str:
    """Digest of all sources of the tangent program."""
    effects = dict(laws)
    return digest(effects, tangent_program_source(effects), *map(_tangent_law_source, effects.values()))


def _tangent_law_source(effect: Effect) -> str:
    return tangent_source(effect.law, "tangent", set(_changes(effect, 0)), DIRECTIONS)


def _values(effect: Effect) -> dict[str, str]:
    """Expressions of the program for the arguments that the effect's law may have."""
    values = {name: name for name in (*GIVEN, *SCALES, YIELDED)}
    values |= {state: f"x[j + {n}]" for n, state in enumerate(effect.states)}
    return values | {parameter.name: f"p[i + {n}]" for n, parameter in enumerate(effect.parameters)}


def _changes(effect: Effect, number: int) -> dict[str, str]:
    """Expressions of the program for the rates of change, along a direction, of the arguments that the effect's law may
    have."""
    changes = {name: change_of(name, number) for name in (*SCALES, YIELDED)}
    changes |= {state: f"x[j_{number} + {n}]" for n, state in enumerate(effect.states)}
    return changes | {one.name: f"change_of_p[{number}, i + {n}]" for n, one in enumerate(effect.parameters)}


def _scales(effect: Effect) -> tuple[str, ...]:
    """Channels that multiply the effect's force; effects that set them come first."""
    return KINDS[effect.kind] if effect.kind else ()


def _published(effects: Mapping[str, Effect], offsets: Mapping[str, str]) -> list[str]:
    """Lines that look up the hysteretic variable before any law needs it.

    Args:
        effects: at most one of those in a model publishes a state.
        offsets: names that the lines set, each with what is added to the state's index to find the value.
    """
    lines = [f"    {name} = 0.0" for name in offsets]
    for code, name in enumerate(in_opcode_order(effects)):
        if state := effects[name].publishes:
            lines += ["    for s in range(opcode.size):", f"        if opcode[s] == {code}:"]
            at = f"at_x[s] + {effects[name].states.index(state)}"
            lines += [f"            {known} = x[{at}{offset}]" for known, offset in offsets.items()]
    return lines


def _force_branch(name: str, effect: Effect) -> list[str]:
    """Lines that call an effect's law and add its result to, or multiply it with, its channel."""
    results = ", ".join(["y", *(f"dx[j + {n}]" for n in range(len(effect.states)))])
    arguments = ", ".join(_values(effect)[need] for need in effect.needs)
    scaled = " * ".join([*_scales(effect), "y"])
    return [
        f"            {results} = law_{name}({arguments})",
        f"            {effect.acts_on} {'*=' if CHANNELS[effect.acts_on].neutral else '+='} {scaled}",
    ]


def _tangent_branch(name: str, effect: Effect) -> list[str]:
    """Lines that call the tangent of an effect's law and update its channel and the channel's changes."""
    values, rates = _values(effect), [f"dx[j + {n}]" for n in range(len(effect.states))]
    arguments, results = [values[need] for need in effect.needs], [as_tuple(["y", *rates])]
    channel, lines = effect.acts_on, list[str]()
    factors = [*_scales(effect), "y"]
    for number in range(DIRECTIONS):
        changes, change = _changes(effect, number), change_of(channel, number)
        arguments += [changes[need] for need in effect.needs if need in changes]
        theirs = [f"dx[j_{number} + {n}]" for n in range(len(effect.states))]
        results.append(as_tuple([change_of("y", number), *theirs]))
        if CHANNELS[channel].neutral:
            lines.append(f"{change} = {change} * y + {channel} * {change_of('y', number)}")
        else:
            each = ([*factors[:n], change_of(one, number), *factors[n + 1 :]] for n, one in enumerate(factors))
            lines.append(f"{change} += {' + '.join(' * '.join(one) for one in each)}")
    lines.append(f"{channel} *= y" if CHANNELS[channel].neutral else f"{channel} += {' * '.join(factors)}")
    call = f"{', '.join(results)} = tangent_{name}({', '.join(arguments)})"
    return [f"            {line}" for line in (call, *lines)]
