"""All hidden laws by name, and the one compiled function that answers for any of them."""

from collections.abc import Callable, Mapping
from functools import cache
from types import MappingProxyType
from typing import Any

from numba import njit

from hidden.law import Law
from hidden.laws import elastic, layer, outside, remembering, rubber, rubbing, viscous, yielding

MODULES = (layer, elastic, viscous, rubbing, yielding, remembering, rubber, outside)
LAWS: Mapping[str, Law] = MappingProxyType({law.name: law for module in MODULES for law in module.LAWS})
ORDER = tuple(LAWS)
"""The index is the law's code."""


@cache
def compiled_laws() -> Any:  # noqa: ANN401  numba's functions have no type
    """(code, p, s, s1, step, past) → what that law answers.

    Written as one flat chain: numba optimises what is nested anew at every level.
    """
    laws = {f"law_{number}": njit(advance) for number, advance in enumerate(_advances())}
    lines = ["def chosen(code, p, s, s1, step, past):"]
    for number, name in enumerate(laws):
        lines += [f"    if code == {number}:", f"        return {name}(p, s, s1, step, past)"]
    namespace: dict[str, Any] = dict(laws)
    exec("\n".join([*lines, "    return 0.0"]), namespace)  # the source is ours, as above
    return njit(namespace["chosen"])


def law_code(law: Law) -> int:
    """By which the compiled function knows the law."""
    return _advances().index(law.advance)


def _advances() -> list[Callable[..., float]]:
    """Every function once: some laws share one."""
    return list(dict.fromkeys(law.advance for law in LAWS.values()))
