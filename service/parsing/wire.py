"""Requests and answers between the service and its parser: JSON and raw samples, which can only be data.

A message is the length of its JSON (8 bytes, big-endian), the JSON, and the blocks of bytes whose sizes the JSON gives.
"""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import IO, Any

import numpy as np
import orjson

from service.formats import Contents, FormatError, Gain, Trace, UnknownFormatError, UnknownUnitError

LONGEST_JSON = 64 * 2**20  # bytes
NUMBERS = {"int32": np.int32, "float32": np.float32, "float64": np.float64}

Json = Mapping[str, Any]


def send(stream: IO[bytes], message: Json, blocks: Sequence[memoryview | bytes] = ()) -> None:
    """Write a message."""
    written = orjson.dumps({**message, "sizes": [memoryview(block).nbytes for block in blocks]})
    stream.write(len(written).to_bytes(8, "big"))
    stream.write(written)
    for block in blocks:
        stream.write(block)
    stream.flush()


def receive(stream: IO[bytes], most: int) -> tuple[Json, list[bytearray]]:
    """Read a message.

    Args:
        stream: to read from.
        most: bytes that its blocks may have together.

    Raises:
        EOFError: the other side has closed, or sent an invalid message.
    """
    size = int.from_bytes(_exactly(stream, 8), "big")
    if size > LONGEST_JSON:
        raise EOFError(f"a message of {size} bytes")
    message = orjson.loads(_exactly(stream, size))
    if sum(message["sizes"]) > most:
        raise EOFError(f"blocks of {sum(message['sizes'])} bytes")
    return message, [_exactly(stream, size) for size in message["sizes"]]


def _exactly(stream: IO[bytes], size: int) -> bytearray:
    received = bytearray(size)
    view = memoryview(received)
    while view:
        count = stream.readinto(view)  # type: ignore[attr-defined]  # every buffered stream has it
        if not count:
            raise EOFError("the other side has closed")
        view = view[count:]
    return received


def written_gains(gains: Mapping[str, Gain]) -> dict[str, list[Any]]:
    """Gains as JSON."""
    return {channel: [gain.si_per_count, gain.quantity] for channel, gain in gains.items()}


def read_gains(written: Json) -> dict[str, Gain]:
    """Gains from JSON."""
    return {channel: Gain(*gain) for channel, gain in written.items()}


def written_contents(contents: Contents) -> tuple[Json, list[memoryview]]:
    """A file's contents as JSON, and the samples of its traces."""
    traces = [
        {
            "channel": trace.channel,
            "start": trace.start.isoformat(),
            "rate": trace.rate,
            "numbers": trace.numbers.dtype.name,
            "gain": trace.gain,
            "quantity": trace.quantity,
            "sensor": trace.sensor,
        }
        for trace in contents.traces
    ]
    message = {
        "kind": contents.kind,
        "traces": traces,
        "gains": written_gains(contents.gains),
        "without_unit": contents.without_unit,
        "remarks": contents.remarks,
    }
    return message, [np.ascontiguousarray(trace.numbers).data.cast("B") for trace in contents.traces]


def read_contents(message: Json, blocks: Sequence[bytearray]) -> Contents:
    """A file's contents from JSON and samples."""
    traces = (
        Trace(
            channel=trace["channel"],
            start=datetime.fromisoformat(trace["start"]),
            rate=trace["rate"],
            numbers=np.frombuffer(block, NUMBERS[trace["numbers"]]),
            gain=trace["gain"],
            quantity=trace["quantity"],
            sensor=trace["sensor"],
        )
        for trace, block in zip(message["traces"], blocks, strict=True)
    )
    return Contents(
        kind=message["kind"],
        traces=tuple(traces),
        gains=read_gains(message["gains"]),
        without_unit=tuple(message["without_unit"]),
        remarks=tuple(message["remarks"]),
    )


def written_refusal(error: FormatError) -> Json:
    """An error as JSON."""
    channels = error.channels if isinstance(error, UnknownUnitError) else None
    return {"refusal": str(error), "channels": channels, "unknown": isinstance(error, UnknownFormatError)}


def read_refusal(message: Json) -> FormatError:
    """An error from JSON."""
    if message["channels"] is not None:
        return UnknownUnitError(tuple(message["channels"]))
    return (UnknownFormatError if message["unknown"] else FormatError)(message["refusal"])
