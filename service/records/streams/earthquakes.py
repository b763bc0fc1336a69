"""Earthquakes in a live stream: found in the ring buffer by the trigger, cut out when they are over.

The trigger has no state of its own: it reads the ring buffer again around what came, so that packets may come late,
twice or out of order, and the service may stop at any moment.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from typing import Any

import numpy as np

from service.formats import Trace
from service.formats.trace import Span, overlapping
from service.records.tables import Packet
from service.records.trigger import TriggerSettings, Window, windows

NEAR = timedelta(seconds=60)
"""Packets this far apart are looked at together."""
SAME = timedelta(seconds=2)
"""Tolerance within which two limits of an earthquake are one: the trigger's depend a little on the data before them."""


@dataclass(frozen=True, slots=True)
class Shaking:
    """An earthquake that is not over."""

    window: Window
    """As far as it is known."""
    peaks: Mapping[str, float]
    """m/s², largest acceleration so far, by channel."""

    @property
    def largest(self) -> float:
        """m/s², of all channels."""
        return max(self.peaks.values(), default=0.0)


@dataclass(frozen=True, slots=True)
class Cut:
    """An earthquake that was cut out."""

    start: datetime
    end: datetime
    upto: int
    """Id of the last packet that had come."""
    late_since: datetime | None = None
    """Time when the last packet of it came that is not in it; None if there is none."""


def memory(trigger: TriggerSettings) -> timedelta:
    """Time before and after a packet that decides, with it, what the trigger sees."""
    return trigger.before + trigger.after + timedelta(seconds=2 * trigger.long)


def areas(packets: Iterable[Packet], shaking: Iterable[Window]) -> list[Span]:
    """The spans of time to look at: those of new packets, with the earthquakes that are not over, apart from others."""
    spans = [(packet.start, packet.end) for packet in packets] + [(one.start, one.end) for one in shaking]
    groups = overlapping(spans, lambda span: span, NEAR)
    return [(min(start for start, _ in group), max(end for _, end in group)) for group in groups]


def found(traces: Iterable[Trace], trigger: TriggerSettings, longest: timedelta) -> list[Window]:
    """The earthquakes in the traces, each `longest` at most."""
    shaking = [trace.segment() for trace in traces if trace.quantity == "acceleration"]
    return [Window(one.start, min(one.end, one.start + longest)) for one in windows(shaking, trigger)]


def is_over(window: Window, traces: Sequence[Trace], patience: timedelta, silence: timedelta) -> bool:
    """True if all that will soon come of an earthquake is there.

    Args:
        window: of the earthquake.
        traces: around it.
        patience: time for which a channel that stays behind the others is waited for.
        silence: time since the last packet.
    """
    reached: dict[str, datetime] = {}
    for trace in traces:
        start, end = trace.span
        if start <= window.end + NEAR and end >= window.start - NEAR:
            reached[trace.channel] = max(reached.get(trace.channel, end), end)
    if not reached or silence >= patience:
        return True
    return min(reached.values()) >= window.end or max(reached.values()) >= window.end + patience


def peaks(traces: Iterable[Trace], window: Window) -> dict[str, float]:
    """m/s², the largest acceleration within a window, by channel; offsets are removed."""
    largest: dict[str, float] = {}
    for trace in traces:
        if trace.quantity != "acceleration" or (within := trace.cut(window.start, window.end)) is None:
            continue
        peak = float(np.abs(within.to_si() - np.median(trace.to_si())).max())
        largest[trace.channel] = max(largest.get(trace.channel, 0.0), peak)
    return largest


def with_late(cuts: Iterable[Cut], packets: Sequence[Packet]) -> list[Cut]:
    """The cuts, with a note where packets of them have come since."""
    noted = []
    for cut in cuts:
        came = [
            one.received_at for one in packets if one.id > cut.upto and one.start <= cut.end and one.end >= cut.start
        ]
        noted.append(replace(cut, late_since=max(came)) if came else cut)
    return noted


def back_to(cuts: Iterable[Cut], number: int) -> list[Cut]:
    """The cuts, as if the packets from this id on had come after them."""
    return [replace(cut, upto=min(cut.upto, number - 1)) for cut in cuts]


def cut_at(cuts: Iterable[Cut], window: Window) -> Cut | None:
    """The cut that a window overlaps."""
    return next((one for one in cuts if one.start <= window.end and one.end >= window.start), None)


def joined(window: Window, cut: Cut | None, longest: timedelta) -> Window | None:
    """The window with the cut before it, where it goes on with it; None if nothing of it is new."""
    if cut is None:
        return window
    if window.start >= cut.start - SAME and window.end <= cut.end + SAME:
        return None
    whole = Window(min(window.start, cut.start), max(window.end, cut.end))
    return whole if whole.end - whole.start <= longest else Window(cut.end, window.end)


def written_shaking(going: Iterable[Shaking]) -> list[dict[str, Any]]:
    """As JSON."""
    return [
        {"start": one.window.start.isoformat(), "end": one.window.end.isoformat(), "peaks": dict(one.peaks)}
        for one in going
    ]


def read_shaking(document: Iterable[Mapping[str, Any]]) -> list[Shaking]:
    """From JSON."""
    moment = datetime.fromisoformat
    return [Shaking(Window(moment(one["start"]), moment(one["end"])), one["peaks"]) for one in document]


def written_cuts(cuts: Iterable[Cut]) -> list[dict[str, Any]]:
    """As JSON."""
    return [
        {
            "start": one.start.isoformat(),
            "end": one.end.isoformat(),
            "upto": one.upto,
            "late_since": None if one.late_since is None else one.late_since.isoformat(),
        }
        for one in cuts
    ]


def read_cuts(document: Iterable[Mapping[str, Any]]) -> list[Cut]:
    """From JSON."""
    moment = datetime.fromisoformat
    return [
        Cut(
            moment(one["start"]),
            moment(one["end"]),
            one["upto"],
            None if one["late_since"] is None else moment(one["late_since"]),
        )
        for one in document
    ]
