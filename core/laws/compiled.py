"""How are laws and kernels compiled, and kept for the next process?

Numba keeps what it compiles in files of its own beside the source, or in the user's cache folder, and takes it for
fresh as long as that one source file is unchanged. What is compiled here is made of many files: so its name bears a
digest of all that goes into it. Where no folder can be written, everything is compiled anew in every process.
"""

from collections.abc import Callable, Mapping
from hashlib import sha256
from inspect import getsource
from types import FunctionType
from typing import Any

from numba import njit

from core.effect import Effect

OPTIONS: Mapping[str, Any] = {"error_model": "numpy", "fastmath": {"contract", "reassoc", "arcp", "nsz"}}
"""Sums may be reordered; NaN and infinity stay, so that a divergence is seen."""

jitted = njit(**OPTIONS)
inlined = njit(**OPTIONS, inline="always")
"""For what a kernel calls in its innermost loop: to hand over ten arrays would take longer than the work."""


def bound(function: Callable[..., Any], **names: Any) -> FunctionType:  # noqa: ANN401  whatever it calls
    """The function with these global names: numba keeps no closures."""
    assert isinstance(function, FunctionType)
    made = FunctionType(function.__code__, {**function.__globals__, **names}, function.__name__)
    made.__module__ = function.__module__
    return made


def kept(function: FunctionType, digest: str) -> Any:  # noqa: ANN401  numba's functions have no type
    """The function compiled, now or by an earlier process.

    Args:
        function: compiled when first called.
        digest: of all it is made of besides its own file.
    """
    function.__qualname__ = f"{function.__name__}_{digest}"
    try:
        return njit(**OPTIONS, cache=True)(function)
    except RuntimeError:  # numba found no folder that can be written
        return jitted(function)


def digest(effects: Mapping[str, Effect], *sources: str) -> str:
    """Of the effects' laws, the numbers that they read from their files, and other sources."""
    texts = [repr(sorted(OPTIONS["fastmath"])), *sources]
    for name, effect in sorted(effects.items()):
        law: Any = effect.law
        numbers = {n: v for n in law.__code__.co_names if isinstance(v := law.__globals__.get(n), int | float)}
        texts += [name, getsource(law), repr(sorted(numbers.items()))]
    return sha256("\0".join(texts).encode()).hexdigest()[:24]
