"""The server of these tests speaks SeedLink as two clients that know nothing of it understand it."""

from datetime import timedelta
from threading import Thread
from time import sleep

import pytest
from monitoring_server import START, miniseed, stream
from obspy import Trace
from obspy.clients.seedlink.easyseedlink import EasySeedLinkClient
from seedlink_client import Protocol, SeedLink
from seedlink_server import SeedLinkServer, seedlink_server

pytestmark = pytest.mark.sqlite
CHANNEL = "XX.TOWER.01.HNX"


class EnoughError(Exception):
    """All wanted packets have come: ObsPy's client offers no other way to end."""


class Seen(EasySeedLinkClient):  # type: ignore[misc]  # ObsPy has no types
    """ObsPy's client, until it has seen so many packets."""

    def begin(self, packets: int) -> None:
        self.traces: list[Trace] = []
        self.wanted = packets
        self.conn.timeout = 10.0  # without one, its own check of the connection fails
        self.connect()

    def on_data(self, trace: Trace) -> None:
        self.traces.append(trace)
        if len(self.traces) == self.wanted:
            raise EnoughError


def add_when_connected(server: SeedLinkServer, data: bytes) -> None:
    while not server.do("count"):
        sleep(0.02)
    server.add(data)


def test_obspy_reads_what_was_sent_and_the_answer_to_info() -> None:
    data = stream(seconds=10)
    records = miniseed(data.select(id=CHANNEL))
    with seedlink_server("3") as server:
        client = Seen(f"127.0.0.1:{server.port}", autoconnect=False)
        client.begin(len(records) // 512)
        assert 'name="TOWER"' not in client.get_info("STATIONS")
        client.select_stream("XX", "TOWER", "01HNX")
        Thread(target=add_when_connected, args=(server, miniseed(data))).start()
        with pytest.raises(EnoughError):
            client.run()
        client.conn.disconnect()
        assert [trace.id for trace in client.traces] == [CHANNEL] * (len(records) // 512)
        assert (client.traces[0].data == data.select(id=CHANNEL)[0].data[: client.traces[0].stats.npts]).all()
        again = Seen(f"127.0.0.1:{server.port}", autoconnect=False)
        again.begin(1)
        assert 'name="TOWER"' in again.get_info("STATIONS")
        again.conn.disconnect()


@pytest.mark.parametrize("version", ["3", "4"])
def test_seedlink_client_resumes_behind_a_sequence_number(version: str) -> None:
    with seedlink_server() as server:
        server.add(miniseed(stream(seconds=10)))
        server.add(miniseed(stream(START + timedelta(seconds=10), seconds=10)))
        with SeedLink("127.0.0.1", server.port, timeout=10, protocol=Protocol(version)) as client:
            assert "TOWER" in client.info("STATIONS")
            client.add_stream("XX_TOWER", ["01HNX"], seqnum=12)
            packets = client.collect(reconnect=False)
            first = [next(packets) for _ in range(3)]
        assert [packet.station_id for packet in first] == ["XX_TOWER"] * 3
        assert first[0].seqnum is not None
        assert first[0].seqnum > 12
        assert first[0].record().sourceid == "FDSN:XX_TOWER_01_H_N_X"
