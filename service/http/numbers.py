"""How is a long series written, so that everybody reads plain numbers and nobody waits for them?

Numbers of one series share their last decimal place, so they are integers with one exponent: `-12345e-3` is a JSON
number like any other, and an answer of them is little more than half as long as one of floats with all their digits.
"""

from math import floor, log10

import numpy as np
import orjson

from core.arrays import Vector

DIGITS = 8
"""Of a series' peak; a 24-bit digitizer gives seven."""


def rounded(values: Vector) -> Vector:
    """(n,) the numbers that `written` gives, unit as given; NaN stays."""
    return _floats(*_integers(values)) if _is_regular(values) else values


def written(values: Vector) -> orjson.Fragment:
    """A series as a JSON array, null where it is not finite.

    Args:
        values: (n,) any unit.
    """
    if not _is_regular(values):
        return orjson.Fragment(orjson.dumps(np.ascontiguousarray(values), option=orjson.OPT_SERIALIZE_NUMPY))
    integers, exponent = _integers(values)
    last = b"e%d" % exponent if exponent else b""
    body = orjson.dumps(integers, option=orjson.OPT_SERIALIZE_NUMPY)
    return orjson.Fragment(body[:-1].replace(b",", last + b",") + last + b"]")


def _is_regular(values: Vector) -> bool:
    """Whether all have digits in common: finite, and not all zero or nothing at all."""
    peak = float(np.abs(values).max(initial=0.0))
    return 1e-14 < peak < 1e29  # false for NaN; within, every power of ten that is needed is exact


def _integers(values: Vector) -> tuple[np.ndarray[tuple[int], np.dtype[np.int32]], int]:
    exponent = floor(log10(float(np.abs(values).max()))) + 1 - DIGITS
    scaled = values * 10.0**-exponent if exponent < 0 else values / 10.0**exponent
    return np.rint(scaled).astype(np.int32), exponent


def _floats(integers: np.ndarray[tuple[int], np.dtype[np.int32]], exponent: int) -> Vector:
    """Nearest to the decimal number, as every reader of the written one gets them."""
    power = float(10 ** abs(exponent))
    return integers.astype(float) / power if exponent < 0 else integers.astype(float) * power
