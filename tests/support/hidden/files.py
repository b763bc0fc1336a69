"""A trial as files that `menshin` reads: a building file, one miniSEED file for each earthquake, and what is hidden."""

import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

import numpy as np
import obspy

from core.description import BuildingDescription
from core.record import Record
from hidden.plan import FITTED
from hidden.trial import Trial

BUILDING, ANSWER = "building.toml", "hidden.json"
UNITS = {"acceleration": "m/s**2", "displacement": "m", "temperature": "degC"}


def write(trial: Trial, folder: Path) -> tuple[Path, ...]:
    """The trial into a folder, which is made; the earthquakes' files by date, the last of them for predicting."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / BUILDING).write_text(building_file(trial.description), encoding="utf-8")
    (folder / ANSWER).write_text(json.dumps(answer(trial), indent=2) + "\n", encoding="utf-8")
    files = tuple(folder / f"event{number}.mseed" for number in range(1, len(trial.events) + 1))
    for file, event in zip(files, trial.events, strict=True):
        _stream(event.record).write(str(file), format="MSEED", encoding="FLOAT64")
    return files


def answer(trial: Trial) -> dict[str, object]:
    """The solution of the trial, for checking only."""
    return {
        "case": trial.case,
        "seed": trial.seed,
        "effects": list(trial.effects),
        "hidden": [{"law": law.name, "form": law.form, "values": dict(values)} for law, values in trial.hidden],
        "faults": [asdict(fault) for fault in trial.faults],
        "softened": trial.softened,
        "misfit": trial.misfit,
        "noise": asdict(trial.noise),
        "layer": asdict(trial.building.layer),
        "total_mass": trial.building.superstructure.total_mass,
        "for_predicting": [f"event{number}.mseed" for number in range(FITTED + 1, len(trial.events) + 1)],
    }


def building_file(described: BuildingDescription) -> str:
    """The description in TOML, as docs/operate/building.md says."""
    return "\n".join(_lines(described)) + "\n"


def _lines(described: BuildingDescription) -> Iterator[str]:
    yield f'code = "{described.code}"'
    yield f'name = "{described.name}"'
    for level in described.levels:
        yield f'[[level]]\nname = "{level.name}"\nrole = "{level.role}"'
        yield from (f"{key} = {value!r}" for key in ("mass", "stiffness") if (value := getattr(level, key)) is not None)
    yield f"[isolation]\nrubber_height = {described.isolation.rubber_height!r}\n[isolation.design]"
    yield from (f"{key} = {value!r}" for key, value in asdict(described.isolation.design).items())
    for channel in described.channels:
        yield f'[[channel]]\nid = "{channel.id}"\nlevel = "{channel.level}"\nquantity = "{channel.quantity}"'
        yield f'gain = 1.0\nunit = "{UNITS[channel.quantity]}"'
        if channel.direction:
            yield f'direction = "{channel.direction}"'


def _stream(record: Record) -> obspy.Stream:
    """One trace for each unbroken piece of a channel."""
    stream = obspy.Stream()
    for channel, samples in zip(record.channels, record.samples, strict=True):
        network, station, location, code = channel.id.split(".")
        header = {"network": network, "station": station, "location": location, "channel": code}
        started = obspy.UTCDateTime(record.start)
        trace = obspy.Trace(
            np.ma.masked_invalid(samples), header | {"starttime": started, "sampling_rate": record.rate}
        )
        stream += trace.split()
    return stream
