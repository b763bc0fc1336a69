"""Compilation of laws and kernels by Numba, with a cache for later processes.

Numba caches compiled functions beside the source, or in the user's cache folder, and considers an entry valid as long
as that one source file is unchanged. The functions here depend on many files, so that their names include a digest of
all sources. If no folder is writable, every process compiles anew.
"""

from collections.abc import Callable, Mapping
from hashlib import sha256
from inspect import getsource
from types import FunctionType
from typing import Any

from core.effect import Effect

OPTIONS: Mapping[str, Any] = {"error_model": "numpy", "fastmath": {"contract", "reassoc", "arcp", "nsz"}}
"""Sums may be reordered; NaN and infinity are preserved, so that divergence shows."""

UNCOUNTED: Mapping[str, Any] = {**OPTIONS, "_nrt": False, "nogil": True}
"""For kernels that make no array. Numba's compiler removes the counting of references to arrays from a loop only up to
a size of its body, which the tangents of all laws exceed: counting took five times as long as the computation."""


def jitted(function: Callable[..., Any]) -> Any:  # noqa: ANN401  untyped
    """The function, compiled at its first call."""
    return _njit(**OPTIONS)(function)


def inlined(function: Callable[..., Any]) -> Any:  # noqa: ANN401  untyped
    """The same, for functions called in a kernel's innermost loop: passing ten arrays would take longer than the
    computation."""
    return _njit(**OPTIONS, inline="always")(function)


def bound(function: Callable[..., Any], **names: Any) -> FunctionType:  # noqa: ANN401  whatever it calls
    """The function with these global names: Numba does not cache closures."""
    assert isinstance(function, FunctionType)
    made = FunctionType(function.__code__, {**function.__globals__, **names}, function.__name__)
    made.__module__ = function.__module__
    return made


def cached(function: FunctionType, digest: str, options: Mapping[str, Any] = OPTIONS) -> Any:  # noqa: ANN401  untyped
    """The compiled function, from the cache of an earlier process if there is one.

    Args:
        function: compiled at its first call.
        digest: of all its sources other than its own file.
        options: of the compilation, OPTIONS or UNCOUNTED.
    """
    function.__qualname__ = f"{function.__name__}_{digest}"
    try:
        return _njit(**options, cache=True)(function)
    except RuntimeError:  # Numba found no writable folder
        return _njit(**options)(function)


def digest(effects: Mapping[str, Effect], *sources: str) -> str:
    """Digest of the effects' laws, of the module constants that they use, and of other sources."""
    options = {**UNCOUNTED, "fastmath": sorted(OPTIONS["fastmath"])}
    texts = [repr(sorted(options.items())), *sources]
    for name, effect in sorted(effects.items()):
        law: Any = effect.law
        numbers = {n: v for n in law.__code__.co_names if isinstance(v := law.__globals__.get(n), int | float)}
        texts += [name, getsource(law), repr(sorted(numbers.items()))]
    return sha256("\0".join(texts).encode()).hexdigest()[:24]


def _njit(**options: Any) -> Any:  # noqa: ANN401  untyped
    """Numba's decorator; only who compiles waits for Numba's import."""
    from numba import njit

    return njit(**options)
