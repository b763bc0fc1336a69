"""All laws compiled into one force function, so that a model is data and needs no compiling.

The function is generated as plain Python source, one branch per effect, and compiled into the kernels that call it.
Measured against it: one compilation per combination of effects, 1.1 s each; closures, twice as slow; channels in an
array instead of local names, two thirds of the time to compile and twice that to run.
"""

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

from core.effect import CHANNELS, CONDITIONS, MOTION, RESULTS, SCALES, YIELDED, Effect
from core.effects import EFFECTS, Laws
from core.laws.compiled import digest, inlined, jitted

GIVEN = (*MOTION, *CONDITIONS)


def in_order(effects: Mapping[str, Effect]) -> tuple[str, ...]:
    """Names of the effects, those that scale others first: the index is the opcode."""
    return tuple(sorted(effects, key=lambda name: (effects[name].acts_on in RESULTS, name)))


def source(effects: Mapping[str, Effect]) -> str:
    """Source of the force function. Slot s of a model has opcode[s], parameters p[at_p[s]:], states x[at_x[s]:]."""
    lines = [f"def force({', '.join(GIVEN)}, opcode, at_p, at_x, p, x, dx):"]
    lines += [f"    {name} = {channel.neutral}" for name, channel in CHANNELS.items()]
    lines += published(effects, {YIELDED: ""})
    lines += ["    for s in range(opcode.size):", "        i, j = at_p[s], at_x[s]"]
    for code, name in enumerate(in_order(effects)):
        lines += [f"        {'elif' if code else 'if'} opcode[s] == {code}:", *_branch(name, effects[name])]
    return "\n".join([*lines, f"    return {', '.join(RESULTS)}"])


def compiled(effects: Mapping[str, Effect]) -> Callable[..., tuple[float, float]]:
    """The force function, jitted: (u, v, u_cross, ..., opcode, at_p, at_x, p, x, dx) → N, kg; fills dx with rates."""
    namespace: dict[str, Any] = {f"law_{name}": jitted(effect.law) for name, effect in effects.items()}
    exec(source(effects), namespace)  # the source is ours, made of the laws above
    program: Callable[..., tuple[float, float]] = inlined(namespace["force"])
    return program


KEPT = 2
"""Sets of laws whose programs a process keeps: that before an effect was added may still be running."""


def of_laws(laws: Laws) -> Mapping[str, Effect]:
    """The effects of these names."""
    return {name: EFFECTS[name] for name in laws}


@lru_cache(KEPT)
def force_program(laws: Laws) -> Callable[..., tuple[float, float]]:
    """The force function of these effects."""
    return compiled(of_laws(laws))


@lru_cache(KEPT)
def opcodes(laws: Laws) -> Mapping[str, int]:
    """Of these effects, by their names."""
    return {name: code for code, name in enumerate(in_order(of_laws(laws)))}


@lru_cache(KEPT)
def force_digest(laws: Laws) -> str:
    """Of all that the force function is made of."""
    effects = of_laws(laws)
    return digest(effects, source(effects))


def place(effect: Effect) -> dict[str, str]:
    """Where the program finds what the effect's law may ask for."""
    found = {known: known for known in (*GIVEN, *SCALES, YIELDED)}
    found |= {state: f"x[j + {n}]" for n, state in enumerate(effect.states)}
    return found | {parameter.name: f"p[i + {n}]" for n, parameter in enumerate(effect.parameters)}


def published(effects: Mapping[str, Effect], offsets: Mapping[str, str]) -> list[str]:
    """Lines that look up the hysteretic variable before any law asks for it.

    Args:
        effects: of which at most one in a model publishes a state.
        offsets: names that the lines set, and what is added to the state's place to find their value.
    """
    lines = [f"    {name} = 0.0" for name in offsets]
    for code, name in enumerate(in_order(effects)):
        if state := effects[name].publishes:
            lines += ["    for s in range(opcode.size):", f"        if opcode[s] == {code}:"]
            at = f"at_x[s] + {effects[name].states.index(state)}"
            lines += [f"            {known} = x[{at}{offset}]" for known, offset in offsets.items()]
    return lines


def _branch(name: str, effect: Effect) -> list[str]:
    results = ", ".join(["y", *(f"dx[j + {n}]" for n in range(len(effect.states)))])
    arguments = ", ".join(place(effect)[need] for need in effect.needs)
    return [
        f"            {results} = law_{name}({arguments})",
        f"            {effect.acts_on} {'*=' if CHANNELS[effect.acts_on].neutral else '+='} y",
    ]
