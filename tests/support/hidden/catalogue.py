"""All hidden laws by name, and the one compiled function that answers for any of them."""

from collections.abc import Callable, Mapping
from functools import cache
from types import MappingProxyType
from typing import Any

from numba import njit

from hidden.law import Law
from hidden.laws import dissipating, elastic, layer, remembering, yielding

MODULES = (layer, yielding, dissipating, elastic, remembering)
LAWS: Mapping[str, Law] = MappingProxyType({law.name: law for module in MODULES for law in module.LAWS})
ORDER = tuple(LAWS)
"""The index is the law's code."""


@cache
def answered() -> Any:  # noqa: ANN401  numba's functions have no type
    """(code, p, s, s1, step, past) → what that law answers. Laws that share a function are compiled once."""
    return _chained(tuple(dict.fromkeys(law.advance for law in LAWS.values())))


def code(law: Law) -> int:
    """By which the compiled function knows the law."""
    return list(dict.fromkeys(other.advance for other in LAWS.values())).index(law.advance)


def _chained(advances: tuple[Callable[..., float], ...]) -> Any:  # noqa: ANN401
    first, rest = njit(advances[0]), advances[1:]
    if not rest:
        return njit(lambda code, p, s, s1, step, past: first(p, s, s1, step, past))
    others = _chained(rest)

    @njit
    def either(code, p, s, s1, step, past):  # noqa: ANN001, ANN202
        return first(p, s, s1, step, past) if code == 0 else others(code - 1, p, s, s1, step, past)

    return either
