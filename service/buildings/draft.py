"""A draft of a building file from station metadata: what is known is written, what is missing is marked.

A line that begins with `#` and has `FILL IN` is a required key without its value; one with `optional` may stay away.
`CHECK` marks what was guessed.
"""

import json
from collections.abc import Iterator, Mapping, Sequence

from core.record import Direction
from service.buildings.station_metadata import StationChannel, Stations

OPENING = """\
# A draft of a building file, from the metadata of {names}.
# Lines with FILL IN lack a required value: remove the # before the key and give it. Lines with "optional" are worth
# giving. Values with CHECK were guessed. Then: menshin building add FILE. All keys: docs/operate/building.md
"""
AXES: Mapping[str, Direction] = {"X": "x", "Y": "y", "Z": "z", "E": "x", "N": "y", "1": "x", "2": "y", "3": "z"}
"""Direction by the last letter of a channel's code (SEED manual 2.4, appendix A)."""
LEAST = 3
"""Levels that a building has: ground, base slab and a floor."""
STEP = 0.5
"""m, difference of height from which on channels are on different levels. Not tuned."""


def draft(stations: Stations, code: str, location: str | None) -> str:
    """The text of a building file.

    Args:
        stations: of the building, with their channels.
        code: of the building.
        location: address of the FDSN server that has the records; None where it is not known.
    """
    levels = _levels(stations.channels)
    level_of = {channel.id: number for number, level in enumerate(levels) for channel in level}
    parts = (
        OPENING.format(names=", ".join(stations.names)).rstrip("\n"),
        "\n".join(_top(stations, code)),
        *("\n".join(_level(number, channels)) for number, channels in enumerate(levels)),
        "\n".join(_isolation()),
        "\n".join(_source(location)),
        *("\n".join(_channel(channel, level_of[channel.id])) for channel in stations.channels),
        *("# left out: " + one for one in stations.remarks),
    )
    return "\n\n".join(parts) + "\n"


def _text(value: str) -> str:
    """A basic string of TOML, which is written as one of JSON is."""
    return json.dumps(value, ensure_ascii=False)


def _missing(key: str, meaning: str) -> str:
    return f"#{key} =   # FILL IN: {meaning}"


def _optional(key: str, meaning: str) -> str:
    return f"#{key} =   # optional: {meaning}"


def _top(stations: Stations, code: str) -> Iterator[str]:
    yield f"code = {_text(code)}"
    yield f"name = {_text(stations.site or code)}   # CHECK: as the metadata call the site"
    yield f"latitude = {stations.latitude:g}"
    yield f"longitude = {stations.longitude:g}"
    yield _optional("timezone", 'IANA name, such as "Asia/Tokyo"; without it UTC')


def _levels(channels: Sequence[StationChannel]) -> list[list[StationChannel]]:
    """The channels by level, from the ground up: by height where the metadata tell heights apart, else by location."""
    rising = sorted(channels, key=lambda one: one.height)
    levels: list[list[StationChannel]] = []
    if rising[-1].height - rising[0].height >= STEP:
        for before, one in zip([None, *rising], rising, strict=False):
            if before is None or one.height - before.height >= STEP:
                levels.append([])
            levels[-1].append(one)
    else:
        places = sorted({channel.place for channel in channels})
        levels = [[one for one in channels if one.place == place] for place in places]
    return [*levels, *([] for _ in range(LEAST - len(levels)))]


def _name(number: int) -> str:
    return ("ground", "base slab")[number] if number < 2 else f"floor {number - 1}"


def _level(number: int, channels: Sequence[StationChannel]) -> Iterator[str]:
    places = ", ".join(dict.fromkeys(channel.place for channel in channels))
    here = f"sensors {places}, {channels[0].height:g} m above the sea" if channels else "no sensor"
    yield "[[level]]"
    yield f"name = {_text(_name(number))}   # CHECK: {here}"
    if number < 2:
        yield f'role = "{("ground", "base")[number]}"'
    if number > 0:
        yield _missing("mass", "kg, of this level")
    if number > 1:
        yield _optional("height", "m, of the storey below this floor; without it its drift cannot be checked")
        yield _optional("stiffness", "N/m, design value of the storey below this floor")


def _isolation() -> Iterator[str]:
    yield "[isolation]"
    yield _optional("rubber_height", "m, total thickness of the rubber; without it no strain can be checked")
    yield _optional("design_displacement", "m, largest displacement that the layer is designed for")
    yield _optional("moat_clearance", "m, smallest gap around the moving building")
    yield _optional("damper_stroke", "m, rated stroke of the dampers")


def _source(location: str | None) -> Iterator[str]:
    if location is None:
        yield "#[source]"
        yield _optional("kind", '"folder", "fdsnws" or "archive": where records are fetched')
        yield _optional("location", "a path, relative to this file, or the server's address")
        return
    yield "[source]"
    yield 'kind = "fdsnws"'
    yield f"location = {_text(location)}"
    yield 'data = "continuous"   # CHECK: "events" where the server has records of earthquakes alone'
    yield _optional("since", "date and time with offset; nothing older is fetched")


def _channel(channel: StationChannel, level: int) -> Iterator[str]:
    yield "[[channel]]"
    yield f"id = {_text(channel.id)}"
    yield f"level = {_text(_name(level))}   # CHECK"
    if channel.quantity is None:
        yield _missing(
            "quantity", '"acceleration", "velocity", "displacement" (of the isolation layer) or "temperature"'
        )
    else:
        yield f'quantity = "{channel.quantity}"'
    if channel.quantity != "temperature":
        yield from _direction(channel)
    if channel.gain is None:
        yield _optional("gain", "of unit per stored number: the metadata have no sensitivity")
        yield _optional("unit", "of gain, such as gal")


def _direction(channel: StationChannel) -> Iterator[str]:
    given = "" if channel.azimuth is None else f", azimuth {channel.azimuth:g}°, dip {channel.dip or 0.0:g}°"
    axis = AXES.get(channel.id[-1].upper())
    if channel.dip is not None and abs(channel.dip) > 45:
        axis = "z"
    if axis is None:
        yield _missing("direction", f'"x" or "y" (horizontal) or "z" (up){given}')
    else:
        yield f'direction = "{axis}"   # CHECK: the building\'s own axes{given}'
