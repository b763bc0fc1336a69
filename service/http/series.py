"""Series as JSON or CSV, complete or thinned for a picture.

Numbers of one series share their last decimal place, so a long series is written as integers with one exponent:
`-12345e-3` is a JSON number like any other, and such an answer is little more than half as long as with all digits.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import floor, log10
from typing import Any

import numpy as np
import orjson
from pydantic import BaseModel

from core.arrays import Indices, Vector
from service.documents.thinning import extremes

OPTIONS = orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_UTC_Z
DIGITS = 8
"""Digits of a series' peak; a 24-bit digitizer gives seven."""


@dataclass(frozen=True, slots=True, eq=False)
class Histories:
    """Series of one rate and length, with the selected samples."""

    rate: float
    """Hz."""
    count: int
    """Samples before thinning."""
    shown: Mapping[str, Vector]
    """(m,) selected samples by the name of the series; any unit."""
    chosen: Indices | None
    """(m,) their indices; None: all."""

    @property
    def time(self) -> Vector:
        """(m,) s after the first sample."""
        return (np.arange(self.count) if self.chosen is None else self.chosen) / self.rate

    def content(self, model: type[BaseModel], /, **described: object) -> dict[str, Any]:
        """The fields of a model with the series as JSON; `time` only where it is not regular.

        Args:
            model: the answer's model, which checks all but the samples.
            described: its other fields.
        """
        fields = described | {"rate": self.rate, "step": 1 / self.rate, "count": self.count, "time": None}
        checked = model.model_validate(fields | {name: [] for name in self.shown})
        series = {name: series_json(one) for name, one in self.shown.items()}
        time = {} if self.chosen is None else {"time": self.time}
        return checked.model_dump(exclude_unset=True) | time | series

    def json(self, model: type[BaseModel], /, **described: object) -> bytes:
        """The same as a response."""
        return written(self.content(model, **described))

    def answer(self, model: type[BaseModel], /, *, as_csv: bool, **described: object) -> bytes:
        """The series as CSV, or as JSON with the other fields of a model."""
        return self.csv() if as_csv else self.json(model, **described)

    def csv(self) -> bytes:
        """Time and series as columns."""
        return csv_lines({"time": self.time} | {name: rounded(one) for name, one in self.shown.items()})


def histories(series: Mapping[str, Vector], rate: float, count: int, points: int | None) -> Histories:
    """Series, thinned to the extremes of every pixel of each of them.

    Args:
        series: (count,) each, any unit.
        rate: Hz.
        count: samples.
        points: most samples shown; None: all.
    """
    if points is None or count <= points or not series:
        return Histories(rate, count, series, None)
    chosen = np.unique(np.concatenate([extremes(one, points // len(series)) for one in series.values()]))
    return Histories(rate, count, {name: one[chosen] for name, one in series.items()}, chosen)


def written(content: Mapping[str, object]) -> bytes:
    """JSON of an answer with series."""
    return orjson.dumps(content, option=OPTIONS)


def joined_lines(pieces: Sequence[tuple[float, Histories]]) -> bytes:
    """Pieces of one series as CSV, with time s after a common start; each piece begins at its offset."""
    time = np.concatenate([offset + piece.time for offset, piece in pieces])
    names = pieces[0][1].shown
    return csv_lines({"time": time} | {n: np.concatenate([rounded(one.shown[n]) for _, one in pieces]) for n in names})


def csv_lines(columns: Mapping[str, Vector]) -> bytes:
    """Series of one length as CSV.

    orjson writes an array of numbers some 50 times faster than csv, and its rows need only other brackets.
    """
    rows = orjson.dumps(np.ascontiguousarray(np.column_stack(list(columns.values()))), option=OPTIONS)
    body = rows[2:-2].replace(b"],[", b"\r\n").replace(b"null", b"")
    return ",".join(columns).encode() + b"\r\n" + body + b"\r\n"


def rounded(values: Vector) -> Vector:
    """(n,) the numbers that `series_json` writes, unit as given; NaN stays."""
    return _floats(*_integers(values)) if _is_regular(values) else values


def series_json(values: Vector) -> orjson.Fragment:
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
    """True if one exponent suits all: finite, not empty and not all zero."""
    peak = float(np.abs(values).max(initial=0.0))
    return 1e-14 < peak < 1e29  # false for NaN; within, every power of ten that is needed is exact


def _integers(values: Vector) -> tuple[np.ndarray[tuple[int], np.dtype[np.int32]], int]:
    exponent = floor(log10(float(np.abs(values).max()))) + 1 - DIGITS
    scaled = values * 10.0**-exponent if exponent < 0 else values / 10.0**exponent
    return np.rint(scaled).astype(np.int32), exponent


def _floats(integers: np.ndarray[tuple[int], np.dtype[np.int32]], exponent: int) -> Vector:
    """Nearest to the decimal number, as every reader of the JSON number gets it."""
    power = float(10 ** abs(exponent))
    return integers.astype(float) / power if exponent < 0 else integers.astype(float) * power
