"""The force program and its tangent: all laws compiled into one function each, so that models need no compiling.

A program is generated as plain Python source, one branch per effect, and compiled into the kernels that call it.
Measured alternatives: one compilation per combination of effects takes 1.1 s each; closures run half as fast; channels
in an array instead of local names take two thirds of the time to compile and twice the time to run.

The tangent program has the same shape. It also computes the rates of change along a direction in the space of the
parameters and states. The change of a state is stored behind it, at a distance of as many entries as there are states.
"""

import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

from core.code_generation.autodiff import change_of, tangent_source
from core.code_generation.compilation import digest, inlined, jitted
from core.effect import CHANNELS, CONDITIONS, KINDS, MOTION, RESULTS, SCALES, STEP, YIELDED, Effect
from core.effects import Laws

GIVEN = (*MOTION, *CONDITIONS, STEP)
"""Arguments of a program that describe the layer's motion and conditions."""
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
    """Source of the tangent program; change_of_p is the direction, `behind` the distance of changes behind states."""
    arguments = f"{', '.join(GIVEN)}, opcode, at_p, at_x, p, {change_of('p')}, behind, x, dx"
    lines = [f"def tangent({arguments}):"]
    for name, channel in CHANNELS.items():
        lines += [f"    {name} = {channel.neutral}", f"    {change_of(name)} = 0.0"]
    lines += _published(effects, {YIELDED: "", change_of(YIELDED): " + behind"})
    lines += ["    for s in range(opcode.size):", "        i, j = at_p[s], at_x[s]", "        k = j + behind"]
    for code, name in enumerate(in_opcode_order(effects)):
        lines += [f"        {'elif' if code else 'if'} opcode[s] == {code}:", *_tangent_branch(name, effects[name])]
    return "\n".join([*lines, f"    return {', '.join([*RESULTS, *map(change_of, RESULTS)])}"])


def compiled_force(effects: Mapping[str, Effect]) -> Callable[..., tuple[float, float]]:
    """The force program, jitted: (u, v, u_cross, ..., opcode, at_p, at_x, p, x, dx) → N, kg; fills dx with rates."""
    namespace: dict[str, Any] = {f"law_{name}": jitted(effect.law) for name, effect in effects.items()}
    exec(force_program_source(effects), namespace)  # the source is ours, made of the laws above
    program: Callable[..., tuple[float, float]] = inlined(namespace["force"])
    return program


def compiled_tangent(effects: Mapping[str, Effect]) -> Callable[..., tuple[float, float, float, float]]:
    """The tangent program, jitted."""
    namespace: dict[str, Any] = {f"tangent_{name}": tangent_law(effect) for name, effect in effects.items()}
    exec(tangent_program_source(effects), namespace)  # the source is ours, made of the laws' tangents
    program: Callable[..., tuple[float, float, float, float]] = inlined(namespace["tangent"])
    return program


def tangent_law(effect: Effect) -> Callable[..., tuple[float, ...]]:
    """Tangent of an effect's law with respect to its states, parameters and the results of other laws, jitted."""
    namespace: dict[str, Any] = {**effect.law.__globals__, "math": math}
    exec(_tangent_law_source(effect), namespace)
    tangent: Callable[..., tuple[float, ...]] = jitted(namespace["tangent"])
    return tangent


@lru_cache(MOST_CACHED)
def force_program(laws: Laws) -> Callable[..., tuple[float, float]]:
    """Force program of these effects."""
    return compiled_force(dict(laws))


@lru_cache(MOST_CACHED)
def tangent_program(laws: Laws) -> Callable[..., tuple[float, float, float, float]]:
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
    return tangent_source(effect.law, "tangent", set(_changes(effect)))


def _values(effect: Effect) -> dict[str, str]:
    """Expressions of the program for the arguments that the effect's law may have."""
    values = {name: name for name in (*GIVEN, *SCALES, YIELDED)}
    values |= {state: f"x[j + {n}]" for n, state in enumerate(effect.states)}
    return values | {parameter.name: f"p[i + {n}]" for n, parameter in enumerate(effect.parameters)}


def _changes(effect: Effect) -> dict[str, str]:
    """Expressions of the program for the rates of change of the arguments that the effect's law may have."""
    changes = {name: change_of(name) for name in (*SCALES, YIELDED)}
    changes |= {state: f"x[k + {n}]" for n, state in enumerate(effect.states)}
    return changes | {parameter.name: f"{change_of('p')}[i + {n}]" for n, parameter in enumerate(effect.parameters)}


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
    """Lines that call the tangent of an effect's law and update its channel and the channel's change."""
    values, changes = _values(effect), _changes(effect)
    rates, theirs = ([f"dx[{at} + {n}]" for n in range(len(effect.states))] for at in "jk")
    arguments = [*(values[n] for n in effect.needs), *(changes[n] for n in effect.needs if n in changes)]
    channel, change = effect.acts_on, change_of(effect.acts_on)
    if CHANNELS[channel].neutral:
        lines = [f"{change} = {change} * y + {channel} * {change_of('y')}", f"{channel} *= y"]
    else:
        factors = [*_scales(effect), "y"]
        each = (" * ".join([*factors[:n], change_of(factor), *factors[n + 1 :]]) for n, factor in enumerate(factors))
        lines = [f"{change} += {' + '.join(each)}", f"{channel} += {' * '.join(factors)}"]
    call = f"{', '.join(['y', *rates, change_of('y'), *theirs])} = tangent_{name}({', '.join(arguments)})"
    return [f"            {line}" for line in (call, *lines)]
