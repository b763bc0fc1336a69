"""What a monitoring server holds: waveforms, stations and earthquakes; it may grow while it is being served."""

from collections.abc import Sequence
from copy import copy
from fnmatch import fnmatchcase
from threading import Lock

from obspy import Inventory, Stream, Trace, UTCDateTime
from obspy.core.event import Catalog, Event
from obspy.core.inventory import Channel, Network, Station

from service.records.fdsn_query import Selection


class Archive:
    """Waveforms, stations and earthquakes. Reading and adding may happen in different threads."""

    def __init__(self, inventory: Inventory, traces: Sequence[Trace] = (), events: Sequence[Event] = ()) -> None:
        self.inventory = inventory
        self._traces = tuple(traces)
        self._events = tuple(events)
        self._growing = Lock()

    def add(self, traces: Sequence[Trace], event: Event) -> None:
        """A new record and the earthquake that it is of."""
        with self._growing:
            self._traces += tuple(traces)
            self._events += (event,)

    def waveforms(self, selection: Selection) -> Stream:
        """The samples of the selected channels between the selected times, both included; may be empty."""
        selected = [trace for trace in self._traces if _holds(trace, selection)]
        return Stream(selected).slice(selection.start, selection.end)

    def stations(self, selection: Selection) -> Inventory:
        """The selected channels that were in operation between the selected times; may be empty."""
        networks = [_network(network, selection) for network in self.inventory]
        return Inventory(networks=[network for network in networks if network.stations], source=self.inventory.source)

    def earthquakes(self, start: UTCDateTime, end: UTCDateTime) -> Catalog:
        """The earthquakes between two times, the latest first; may be empty."""
        found = [event for event in self._events if start <= event.preferred_origin().time <= end]
        return Catalog(sorted(found, key=lambda event: event.preferred_origin().time, reverse=True))


def _holds(trace: Trace, selection: Selection) -> bool:
    stats = trace.stats
    return bool(
        stats.starttime <= selection.end
        and stats.endtime >= selection.start
        and _named(stats.network, selection.network)
        and _named(stats.station, selection.station)
        and _named(stats.location, selection.location)
        and _named(stats.channel, selection.channel)
    )


def _network(network: Network, selection: Selection) -> Network:
    chosen = copy(network)
    stations = [_station(station, selection) for station in network if _named(network.code, selection.network)]
    chosen.stations = [station for station in stations if station.channels]
    return chosen


def _station(station: Station, selection: Selection) -> Station:
    chosen = copy(station)
    kept = [channel for channel in station if _named(station.code, selection.station)]
    chosen.channels = [channel for channel in kept if _operating(channel, selection)]
    return chosen


def _operating(channel: Channel, selection: Selection) -> bool:
    return (
        _named(channel.location_code, selection.location)
        and _named(channel.code, selection.channel)
        and channel.is_active(starttime=selection.start, endtime=selection.end)
    )


def _named(code: str, wanted: str) -> bool:
    return any(fnmatchcase(code, "" if pattern == "--" else pattern) for pattern in wanted.split(","))
