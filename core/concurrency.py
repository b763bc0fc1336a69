"""Independent computations at once, on all processors.

The compiled kernels and the transforms release the interpreter's lock, so that threads share the work and no data is
copied.
"""

from collections.abc import Callable, Generator, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

MOST = 8
"""Threads at most: what they do between the kernels takes turns. A choice."""
Given = TypeVar("Given")
Made = TypeVar("Made")


@cache
def processors() -> int:
    """Number of processors available to this process, within its CPU affinity and the quota of its container."""
    from loky import cpu_count  # it takes longer to import than commands that need no processors may take

    return int(cpu_count())


def at_once(compute: Callable[[Given], Made], each: Iterable[Given]) -> Generator[Made]:
    """Results in the order of what they are computed from. Once it is closed, nothing more is begun.

    Args:
        compute: one result; it may be called from several threads.
        each: what to compute from.

    Raises:
        Exception: that of the first computation that raised one; those that have not begun are left out.
    """
    given = tuple(each)
    threads = min(processors(), len(given), MOST)
    if threads < 2:
        yield from map(compute, given)
        return
    with ThreadPoolExecutor(threads) as pool:
        waiting = [pool.submit(compute, one) for one in given]
        try:
            for one in waiting:
                yield one.result()
        finally:
            for one in waiting:
                one.cancel()
