"""Series as compressed blobs, small and fast to read: records lossless, estimated histories as fine as they are known.

Counts of a digitizer are smooth, so their second differences are small and bitshuffle packs their unused bits. A
history becomes such counts, of a step far below its standard deviation.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from core.arrays import Vector

Series = np.ndarray[tuple[int], np.dtype[Any]]

COUNTS = np.dtype(np.int32)
KINDS: Mapping[bytes, np.dtype[Any]] = {b"i": COUNTS, b"f": np.dtype(np.float32), b"d": np.dtype(np.float64)}
KIND_OF: Mapping[np.dtype[Any], bytes] = {dtype: kind for kind, dtype in KINDS.items()}
STEPS = b"q"
"""Kind of a history in whole steps: the step follows as a 64-bit float, then the counts as of a digitizer."""
STEP_BYTES = 8
SINGLE = 2.0**-24
"""Largest relative error of rounding to single precision."""
ROUNDING = 0.01
"""Largest rounding error over the standard deviation: together they are 0.005 % larger than the deviation alone."""
DEVIATION_BITS = 10
"""Bits after the leading one of a standard deviation's digits: rounding changes it by 0.05 % at most."""
LARGEST = 2**30
"""Largest count of steps. Second differences wrap around, so that it only has to fit into 32 bits."""
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
    """(n,) series from the bytes of `encode`, `encode_history` or `encode_deviation`."""
    if blob[:1] == STEPS:
        step = float(np.frombuffer(blob[1 : 1 + STEP_BYTES], "<f8")[0])
        return step * twice_summed(_unpacked(memoryview(blob)[1 + STEP_BYTES :], COUNTS))
    dtype = KINDS[blob[:1]]
    if len(blob) == 1:
        return np.zeros(0, dtype)
    series = _unpacked(memoryview(blob)[1:], dtype)
    return twice_summed(series) if dtype == COUNTS else series


def encode_history(values: Vector, std: Vector | None = None) -> bytes:
    """An estimated history as bytes, rounded by at most `ROUNDING` of its least standard deviation.

    Args:
        values: (n,) any unit.
        std: (n,) its standard deviation; None for a history without one, which becomes single precision. A history
            that is known to more than 30 bits keeps double precision.
    """
    if std is None:
        return encode(np.asarray(values, np.float32))
    largest = float(np.abs(values).max(initial=0.0))
    tolerance = ROUNDING * float(np.min(std, initial=np.inf))
    if not 0.0 < tolerance < np.inf or not largest < LARGEST * tolerance:
        return encode(np.asarray(values, np.float32 if SINGLE * largest <= tolerance else np.float64))
    step = 2.0 ** np.floor(np.log2(2.0 * tolerance))  # of two, so that whole steps are exact numbers
    counts = np.round(values / step).astype(COUNTS)
    return STEPS + np.array(step, "<f8").tobytes() + _packed(second_difference(counts), BITSHUFFLE)


def encode_deviation(std: Vector) -> bytes:
    """(n,) standard deviations as bytes, to three digits."""
    bits = np.asarray(std, np.float32).view(np.uint32)
    dropped = np.uint32(23 - DEVIATION_BITS)
    is_finite = np.isfinite(std)
    rounded = (bits + np.uint32(1 << (int(dropped) - 1))) >> dropped << dropped
    return encode(np.where(is_finite, rounded, bits).view(np.float32))


def decode_history(blob: bytes) -> Vector:
    """(n,) history in double precision, as this version or an earlier one stored it."""
    return np.asarray(decode(blob), np.float64)


def _packed(series: Series, order: str) -> bytes:
    import blosc2  # slow to import, and many processes read no series

    packed = blosc2.compress2(
        series, codec=blosc2.Codec.LZ4, clevel=5, filters=[blosc2.Filter[order]], typesize=series.itemsize, nthreads=1
    )
    return bytes(packed)


def _unpacked(packed: memoryview, dtype: np.dtype[Any]) -> Series:
    import blosc2

    found: Any = blosc2.decompress2(packed, nthreads=1)
    return np.frombuffer(found, dtype)


def second_difference(series: Series) -> Series:
    """(n,) second difference modulo 2³², so that no jump of the counts is lost."""
    first = np.diff(series, prepend=series.dtype.type(0))
    return np.diff(first, prepend=series.dtype.type(0))


def twice_summed(series: Series) -> Series:
    """(n,) inverse of `second_difference`."""
    summed = np.cumsum(series, dtype=series.dtype)
    return np.cumsum(summed, dtype=series.dtype, out=summed)
