"""State of a building's monitoring between two earthquakes: of which analyses it is, and what each series goes on from.

It is derived: `service.drift.monitoring` makes it again from all results where it is missing, of another version of the
code, or of other reference periods or another description. As bytes it is a JSON document and arrays, compressed.
"""

import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from hashlib import sha256
from typing import Any

import numpy as np
import orjson

from core.drift.deviations import EventSummaries
from core.drift.monitor import Judged, SeriesState
from service.drift.frequencies import Sightings
from service.version import VERSION

LAYOUT = 1
"""Number of the layout of the bytes; another one is not read."""
Name = tuple[str, str]
"""Quantity and subject."""
Array = np.ndarray[Any, np.dtype[Any]]


@dataclass(frozen=True, slots=True, eq=False)
class BuildingState:
    """State of a building's monitoring."""

    analyses: Mapping[int, tuple[int, float]]
    """Number of the analysis that each event's results are of, and the event's start, s since 1970-01-01 UTC."""
    series: Mapping[Name, SeriesState]
    """Series that go on from their state."""
    judged: Mapping[Name, Judged]
    """Means of two directions."""
    others: frozenset[str]
    """Quantities of series that need all their measurements, because their reference is not complete."""
    modes: Mapping[str, Sightings]
    """By direction."""


def facts(revision: int, periods: Sequence[int]) -> str:
    """SHA-256 of what a state holds for, beside the analyses.

    Args:
        revision: number of the building's description.
        periods: numbers of its reference periods.
    """
    return sha256(repr((LAYOUT, VERSION, revision, list(periods))).encode()).hexdigest()


def encoded(state: BuildingState) -> bytes:
    """A state as bytes."""
    import blosc2  # slow to import, and only a worker needs it

    arrays: list[Array] = []

    def put(values: object) -> int:
        arrays.append(np.ascontiguousarray(values))
        return len(arrays) - 1

    def columns(one: object, skipped: int = 0) -> list[int]:
        return [put(getattr(one, field.name)) for field in fields(one)[skipped:]]  # type: ignore[arg-type]

    document = {
        "analyses": [
            put(list(state.analyses)),
            put([analysis for analysis, _ in state.analyses.values()]),
            put([start for _, start in state.analyses.values()]),
        ],
        "series": [
            [*name, one.inputs, columns(one.summaries), columns(one.judged)] for name, one in state.series.items()
        ],
        "judged": [[*name, columns(one)] for name, one in state.judged.items()],
        "others": sorted(state.others),
        "modes": [[name, list(one.levels), columns(one, skipped=1)] for name, one in state.modes.items()],
    }
    document["arrays"] = [[one.dtype.str, list(one.shape)] for one in arrays]
    head = orjson.dumps(document)
    plain = b"".join([struct.pack("<I", len(head)), head, *(one.tobytes() for one in arrays)])
    return bytes(blosc2.compress2(plain, codec=blosc2.Codec.LZ4, clevel=5, typesize=8, nthreads=1))


def decoded(packed: bytes) -> BuildingState:
    """A state from the bytes of `encoded`."""
    import blosc2

    content = blosc2.decompress2(packed, nthreads=1)
    (length,) = struct.unpack_from("<I", content)
    document = orjson.loads(content[4 : 4 + length])
    arrays = list(_arrays(document["arrays"], content, 4 + length))

    def columns(made: Callable[..., Any], places: Sequence[int], *first: object) -> Any:  # noqa: ANN401  what is made
        return made(*first, *(arrays[place] for place in places))

    events, analyses, starts = (arrays[place].tolist() for place in document["analyses"])
    return BuildingState(
        analyses=dict(zip(map(int, events), zip(map(int, analyses), starts, strict=True), strict=True)),
        series={
            (quantity, subject): SeriesState(inputs, columns(EventSummaries, summaries), columns(Judged, judged))
            for quantity, subject, inputs, summaries, judged in document["series"]
        },
        judged={(quantity, subject): columns(Judged, one) for quantity, subject, one in document["judged"]},
        others=frozenset(document["others"]),
        modes={name: columns(Sightings, one, tuple(levels)) for name, levels, one in document["modes"]},
    )


def _arrays(described: Sequence[tuple[str, list[int]]], content: bytes, start: int) -> Iterator[Array]:
    for dtype, shape in described:
        count = int(np.prod(shape))
        yield np.frombuffer(content, dtype, count, start).reshape(shape)
        start += count * np.dtype(dtype).itemsize
