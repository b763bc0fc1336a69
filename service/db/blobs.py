"""Series as compressed blobs: lossless, small and fast to read.

Counts of a digitizer are smooth, so their second differences are small and bitshuffle packs their unused bits.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from core.arrays import Vector

Series = np.ndarray[tuple[int], np.dtype[Any]]

COUNTS = np.dtype(np.int32)
KINDS: Mapping[bytes, np.dtype[Any]] = {b"i": COUNTS, b"f": np.dtype(np.float32), b"d": np.dtype(np.float64)}
KIND_OF: Mapping[np.dtype[Any], bytes] = {dtype: kind for kind, dtype in KINDS.items()}
SINGLE = 2.0**-24
"""Largest relative error of rounding to single precision."""
ROUNDING = 0.01
"""Largest rounding error over the standard deviation: together they are 0.005 % larger than the deviation alone."""
BITSHUFFLE, SHUFFLE = "BITSHUFFLE", "SHUFFLE"


def encode(series: Series) -> bytes:
    """A series as bytes.

    Args:
        series: (n,) int32, float32 or float64; reproduced bit by bit, NaN and overflow included.

    Raises:
        TypeError: another dtype, which is a bug of the caller.
    """
    series = np.ascontiguousarray(series)
    kind = KIND_OF.get(series.dtype)
    if kind is None or series.ndim != 1:
        raise TypeError(f"a series is one-dimensional int32, float32 or float64, got {series.ndim}-d {series.dtype}")
    if series.size == 0:
        return kind
    if series.dtype == COUNTS:
        return kind + _packed(second_difference(series), BITSHUFFLE)
    return kind + _packed(series, SHUFFLE)


def decode(blob: bytes) -> Series:
    """(n,) series from the bytes of `encode`."""
    dtype = KINDS[blob[:1]]
    if len(blob) == 1:
        return np.zeros(0, dtype)
    import blosc2

    unpacked: Any = blosc2.decompress2(memoryview(blob)[1:], nthreads=1)
    series = np.frombuffer(unpacked, dtype)
    return twice_summed(series) if dtype == COUNTS else series


def encode_history(values: Vector, std: Vector | None = None) -> bytes:
    """An estimated history as bytes, in single precision where its uncertainty allows it.

    Args:
        values: (n,) any unit.
        std: (n,) its standard deviation; None for a history that is known to a few digits anyway, such as a standard
            deviation. Where rounding to single precision could change a value by more than `ROUNDING` of it, the
            history keeps double precision.
    """
    largest = float(np.abs(values).max(initial=0.0))
    is_fine = std is None or SINGLE * largest <= ROUNDING * float(np.min(std, initial=np.inf))
    return encode(np.asarray(values, np.float32 if is_fine else np.float64))


def decode_history(blob: bytes) -> Vector:
    """(n,) history in double precision; histories of earlier versions were stored so."""
    return np.asarray(decode(blob), np.float64)


def _packed(series: Series, order: str) -> bytes:
    import blosc2  # slow to import, and many processes read no series

    packed = blosc2.compress2(
        series, codec=blosc2.Codec.LZ4, clevel=5, filters=[blosc2.Filter[order]], typesize=series.itemsize, nthreads=1
    )
    return bytes(packed)


def second_difference(series: Series) -> Series:
    """(n,) second difference modulo 2³², so that no jump of the counts is lost."""
    first = np.diff(series, prepend=series.dtype.type(0))
    return np.diff(first, prepend=series.dtype.type(0))


def twice_summed(series: Series) -> Series:
    """(n,) inverse of `second_difference`."""
    summed = np.cumsum(series, dtype=series.dtype)
    return np.cumsum(summed, dtype=series.dtype, out=summed)
