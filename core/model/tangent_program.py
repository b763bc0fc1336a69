"""All laws' tangents compiled into one function: force and rates, and how they change along one direction.

Generated beside the force program and of the same shape, see core.model.program. A state's rate of change along the
direction stands as far behind it as there are states.
"""

import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

from core.effect import CHANNELS, RESULTS, SCALES, YIELDED, Effect
from core.effects import Laws
from core.laws.compiled import digest, inlined, jitted
from core.laws.tangent import change_of, tangent_source
from core.model.program import GIVEN, KEPT, in_order, of_laws, place, published


def source(effects: Mapping[str, Effect]) -> str:
    """Source of the tangent program; change_of_p is the direction, `behind` how far changes stand behind states."""
    arguments = f"{', '.join(GIVEN)}, opcode, at_p, at_x, p, {change_of('p')}, behind, x, dx"
    lines = [f"def tangent({arguments}):"]
    for name, channel in CHANNELS.items():
        lines += [f"    {name} = {channel.neutral}", f"    {change_of(name)} = 0.0"]
    lines += published(effects, {YIELDED: "", change_of(YIELDED): " + behind"})
    lines += ["    for s in range(opcode.size):", "        i, j = at_p[s], at_x[s]", "        k = j + behind"]
    for code, name in enumerate(in_order(effects)):
        lines += [f"        {'elif' if code else 'if'} opcode[s] == {code}:", *_branch(name, effects[name])]
    return "\n".join([*lines, f"    return {', '.join([*RESULTS, *map(change_of, RESULTS)])}"])


def compiled(effects: Mapping[str, Effect]) -> Callable[..., tuple[float, float, float, float]]:
    """The tangent program, jitted."""
    namespace: dict[str, Any] = {f"tangent_{name}": tangent_law(effect) for name, effect in effects.items()}
    exec(source(effects), namespace)  # the source is ours, made of the laws' tangents
    program: Callable[..., tuple[float, float, float, float]] = inlined(namespace["tangent"])
    return program


def tangent_law(effect: Effect) -> Callable[..., tuple[float, ...]]:
    """The tangent of an effect's law along its states, parameters and what other laws tell it, jitted."""
    namespace: dict[str, Any] = {**effect.law.__globals__, "math": math}
    exec(_law_source(effect), namespace)
    tangent: Callable[..., tuple[float, ...]] = jitted(namespace["tangent"])
    return tangent


@lru_cache(KEPT)
def tangent_program(laws: Laws) -> Callable[..., tuple[float, float, float, float]]:
    """The tangent program of these effects."""
    return compiled(of_laws(laws))


@lru_cache(KEPT)
def tangent_digest(laws: Laws) -> str:
    """Of all that the tangent program is made of."""
    effects = of_laws(laws)
    return digest(effects, source(effects), *map(_law_source, effects.values()))


def _law_source(effect: Effect) -> str:
    return tangent_source(effect.law, "tangent", set(_changes(effect)))


def _changes(effect: Effect) -> dict[str, str]:
    """Where the program finds the rates of change of what the law may ask for."""
    found = {known: change_of(known) for known in (*SCALES, YIELDED)}
    found |= {state: f"x[k + {n}]" for n, state in enumerate(effect.states)}
    return found | {parameter.name: f"{change_of('p')}[i + {n}]" for n, parameter in enumerate(effect.parameters)}


def _branch(name: str, effect: Effect) -> list[str]:
    where, changes = place(effect), _changes(effect)
    rates, theirs = ([f"dx[{at} + {n}]" for n in range(len(effect.states))] for at in "jk")
    arguments = [*(where[n] for n in effect.needs), *(changes[n] for n in effect.needs if n in changes)]
    channel, change = effect.acts_on, change_of(effect.acts_on)
    if CHANNELS[channel].neutral:
        lines = [f"{change} = {change} * y + {channel} * y_change", f"{channel} *= y"]
    else:
        lines = [f"{change} += y_change", f"{channel} += y"]
    call = f"{', '.join(['y', *rates, 'y_change', *theirs])} = tangent_{name}({', '.join(arguments)})"
    return [f"            {line}" for line in (call, *lines)]
