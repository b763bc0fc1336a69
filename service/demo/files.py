"""The simulated building's records as files, for those who would rather work at a command line."""

from pathlib import Path

from obspy import UTCDateTime

from service.demo.memory import RECORDED
from service.demo.stage import RECORDS, STATION, Stage
from service.records.fdsn_query import Selection


def write(stage: Stage) -> Path:
    """One miniSEED file for each earthquake, numbered in order of time, and the StationXML; the folder they lie in."""
    folder = stage.folder / RECORDS
    folder.mkdir(exist_ok=True)
    stage.archive.inventory.write(str(folder / STATION), format="STATIONXML", level="response")
    for number, earthquake in enumerate(stage.earthquakes, start=1):
        arrival = UTCDateTime(earthquake.arrival)
        around = Selection(start=arrival - RECORDED.total_seconds(), end=arrival + RECORDED.total_seconds())
        stage.archive.waveforms(around).write(str(folder / f"{number}.mseed"), format="MSEED")
    return folder
