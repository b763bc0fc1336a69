"""A sketched law as the file of an effect, and as an effect of this process."""

import linecache
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from hashlib import sha256
from keyword import iskeyword

import numpy as np

from core.effect import Effect
from core.errors import ModelError
from core.sketching.search import Placed
from core.sketching.terms import OWN, TERMS, Scales
from core.sketching.texts import EXPLAINED, FAMILY, SUSPECTED, known_range, sketched_from, title

UNITS = {"length": "m", "speed": "m/s", "time": "s", "travel": "m"}
"""Units of a term's own value."""
RANGE = 30.0
"""Factor by which a term's own value may leave its start. A choice."""
SPREAD = 0.7
"""Standard deviation of its logarithm before the fit. A choice: a factor of two."""
LARGEST = 1e12
"""N, largest amplitude."""
INPUTS = ("u", "v", "u_cross", "v_cross", "axial_load", "temperature", "ground")
"""Arguments that a term's expression may have."""
FUNCTIONS = ("copysign", "exp", "sin", "sqrt", "tanh")
"""Functions of module math that a term's expression may have."""
MOST_KEPT = 256
"""Effects that are kept by the text of their files."""
WORD = re.compile(r"[A-Za-z_]\w*")
"""A name in an expression."""


@dataclass(frozen=True, slots=True)
class Law:
    """A sketched law as values alone, from which its effect is written."""

    placed: tuple[Placed, ...]
    amplitudes: tuple[float, ...]
    """N, of each term."""
    scales: Scales
    """The terms' constants: the largest motion in its records."""

    @classmethod
    def of_terms(cls, terms: Sequence[tuple[str, float, float]], scales: Scales) -> "Law":
        """A law from the names of its terms, each with its own value (SI) and its amplitude (N).

        Raises:
            ModelError: a term is unknown, or a value is impossible.
        """
        known = {one.name: one for one in TERMS}
        for name, own, amplitude in terms:
            if name not in known:
                raise ModelError(f"no law of a sketch has a term {name!r}")
            if not (np.isfinite(amplitude) and np.isfinite(own) and (own > 0 or not known[name].shape)):
                raise ModelError(f"a term {name!r} cannot have the value {own!r} and the amplitude {amplitude!r}")
        if not terms or not all(np.isfinite(one) and one > 0 for one in (scales.displacement, scales.velocity)):
            raise ModelError("a law has one term at least, and records that move")
        placed = tuple(Placed(known[name], float(own)) for name, own, _ in terms)
        return cls(placed, tuple(float(amplitude) for _, _, amplitude in terms), scales)


@dataclass(frozen=True, slots=True)
class Line:
    """One term in a law."""

    expression: str
    rates: tuple[str, ...]
    states: tuple[str, ...]
    amplitude: str
    """Name of its force."""
    own: str
    """Name of its length, speed or time; empty for none."""


def effect_source(name: str, law: Law) -> str:
    """Text of a file that holds an effect, in the format of effects of the user's own.

    Args:
        name: of the effect.
        law: the law.

    Raises:
        ModelError: an effect cannot have this name.
    """
    if not name.isidentifier() or iskeyword(name):
        raise ModelError(f"an effect cannot be called {name!r}: choose an unused name of letters, digits and _")
    lines = [_line(number, one, law.scales) for number, one in enumerate(law.placed, start=1)]
    states = [state for line in lines for state in line.states]
    carried = [
        state
        for line, one in zip(lines, law.placed, strict=True)
        if one.term.memory and one.term.memory.is_carried
        for state in line.states
    ]
    parameters = [own for line in lines for own in (line.amplitude, line.own) if own]
    body = " ".join([*(line.expression for line in lines), *(rate for line in lines for rate in line.rates)])
    used = _names(body)
    arguments = [*(one for one in INPUTS if one in used), *states, *parameters]
    results = [" + ".join(f"{line.amplitude} * ({line.expression})" for line in lines)]
    results += [rate for line in lines for rate in line.rates]
    described = [text for line, one, size in zip(lines, law.placed, law.amplitudes, strict=True)
                 for text in _parameters(line, one, float(size))]  # fmt: skip
    returned = ["force", *(f"rate_of_{state}" for state in states)]
    words = ", ".join(one.term.name for one in law.placed)
    sizes = ", ".join(f"{{{line.amplitude}}}" for line in lines)
    known = known_range(law.scales)
    imported = [one for one in FUNCTIONS if one in used]
    text = [
        f'"""Sketched from records: {words}.',
        "",
        known,
        '"""',
        "",
        *([f"from math import {', '.join(imported)}", ""] if imported else []),
        "from core.effect import Effect, LogNormal, Normal, Parameter",
        "",
        "",
        f"def law({', '.join(arguments)}):",
        *(f"    {one} = {value}" for one, value in zip(returned, results, strict=True)),
        f"    return {', '.join(returned)}",
        "",
        "",
        "EFFECT = Effect(",
        f"    title={title(words)!r},",
        "    law=law,",
        *([f"    states={tuple(states)!r},"] if states else []),
        *([f"    carried={tuple(carried)!r},"] if carried else []),
        f"    linear={tuple(line.amplitude for line in lines)!r},",
        "    parameters=(",
        *(f"        {one}," for one in described),
        "    ),",
        f"    absent={ {line.amplitude: 0.0 for line in lines}!r},",
        f"    family={FAMILY!r},",
        f"    explanation={EXPLAINED.format(words, sizes)!r},",
        f"    suspect_when={SUSPECTED!r},",
        f"    source={sketched_from(law.scales)!r},",
        ")",
        "",
    ]
    return "\n".join(text)


@lru_cache(maxsize=MOST_KEPT)
def effect_of(name: str, source: str) -> Effect:
    """The effect of a file's text; the same object for the same text.

    Args:
        name: of the effect.
        source: as of `effect_source`.
    """
    file = f"<{name} {sha256(source.encode()).hexdigest()[:16]}.py>"  # another law of the same name may come later
    namespace: dict[str, object] = {"__name__": __name__}  # compiled code that is kept names a module that exists
    linecache.cache[file] = (len(source), None, source.splitlines(keepends=True), file)  # laws are read from source
    exec(compile(source, file, "exec"), namespace)
    effect = namespace["EFFECT"]
    assert isinstance(effect, Effect)
    return effect


def formula(law: Law) -> str:
    """The law in a line, its forces and own values by name."""
    lines = [_line(number, one, law.scales) for number, one in enumerate(law.placed, start=1)]
    memory = [f"d{state}/dt = {rate}" for line in lines for state, rate in zip(line.states, line.rates, strict=True)]
    return "; ".join(["force = " + " + ".join(f"{line.amplitude} · {line.expression}" for line in lines), *memory])


def _line(number: int, one: Placed, scales: Scales) -> Line:
    term, own = one.term, f"{one.term.shape}_{number}" if one.term.shape else ""
    names: dict[str, str] = {state: f"{state}_{number}" for state in (term.memory.states if term.memory else ())}

    def written(text: str) -> str:
        made = scales.written(text).replace("{s}", own)
        return _renamed(made, names)

    rates = tuple(written(rate) for rate in term.memory.rates) if term.memory else ()
    return Line(written(term.expression), rates, tuple(names.values()), f"force_{number}", own)


def _renamed(text: str, names: Mapping[str, str]) -> str:
    """The text with its names replaced, whole words only."""
    return WORD.sub(lambda found: names.get(found[0], found[0]), text)


def _names(text: str) -> set[str]:
    return set(WORD.findall(text))


def _parameters(line: Line, one: Placed, size: float) -> list[str]:
    """Source of the parameters of one term."""
    start = float(f"{size:.3g}")
    spread = float(f"{abs(size):.3g}") or 1.0
    limit = max(LARGEST, 10 * spread)
    found = [
        f'Parameter("{line.amplitude}", "N", ({-limit!r}, {limit!r}), Normal({start or 1.0!r}, {spread!r}), '
        f"{one.term.meaning!r})"
    ]
    if line.own:
        low, high = (float(f"{value:.3g}") for value in (one.s / RANGE, one.s * RANGE))
        found.append(
            f'Parameter("{line.own}", "{UNITS[one.term.shape]}", ({low!r}, {high!r}), '
            f"LogNormal({float(f'{one.s:.3g}')!r}, {SPREAD!r}), {OWN[one.term.shape]!r})"
        )
    return found


def starts(law: Law) -> dict[str, float]:
    """Values of the effect's parameters where its fit begins."""
    found = {}
    for number, (one, size) in enumerate(zip(law.placed, law.amplitudes, strict=True), start=1):
        found[f"force_{number}"] = float(np.clip(size, -LARGEST, LARGEST))
        if one.term.shape:
            found[f"{one.term.shape}_{number}"] = one.s
    return found
