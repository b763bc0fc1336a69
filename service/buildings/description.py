"""What a building file says: TOML in; a building, or everything that is wrong with the file, out."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from math import radians
from pathlib import Path
from typing import Any, Literal, get_args

from core.description import BuildingDescription, IsolationDesign, IsolationLayer, Level
from core.record import Channel
from service.buildings.description_keys import (
    BuildingTable,
    ChannelTable,
    LevelTable,
    ReceiverTable,
    SourceTable,
)
from service.buildings.recipient_rules import (
    SEVERITIES,
    ReceiverKind,
    ReceiverRule,
    wanted_kinds,
    wrong_address,
    wrong_secret,
)
from service.formats.errors import FormatError
from service.formats.toml_problems import Check, Problem, TomlError, checked, wrong_keys
from service.formats.units import Gain, unit_gain
from service.web_addresses import wrong_web_address


class BuildingFileError(TomlError):
    """All that is wrong with a building file, one problem a line, each with its line and key."""


@dataclass(frozen=True, slots=True)
class SourceFile:
    """Where the building's records are fetched; docs/operate/building.md tells what each key means."""

    kind: Literal["folder", "fdsnws", "archive"]
    location: str
    """An absolute path for a folder, else the address as written."""
    data: Literal["events", "continuous"]
    since: datetime | None
    catalogue: str | None
    minimum_magnitude: float | None
    maximum_radius: float | None
    """degrees."""
    before: float
    """s."""
    after: float
    """s."""


@dataclass(frozen=True, slots=True)
class BuildingFile:
    """A building, its monitoring server and the gains of its channels."""

    description: BuildingDescription
    source: SourceFile | None
    gains: Mapping[str, Gain]
    """By channel id, of the channels that give one; these go before StationXML."""
    latitude: float | None
    longitude: float | None
    timezone: str
    """IANA name."""
    receivers: tuple[ReceiverRule, ...]


def read(text: str, folder: Path) -> BuildingFile:
    """The building that a file describes.

    Args:
        text: the file.
        folder: where it lies; a relative source location starts here.

    Raises:
        BuildingFileError: with every problem of the file, not only the first.
    """
    return _read(text, folder, CHECKS)


def read_new(text: str, folder: Path) -> BuildingFile:
    """The same of a file that comes into force now: its addresses must be such that a server can be asked there.

    A file that is in force already keeps what an earlier version accepted.
    """
    return _read(text, folder, (*CHECKS, _wrong_addresses))


def _read(text: str, folder: Path, checks: Sequence[Check]) -> BuildingFile:
    try:
        document = checked(text, checks)
    except TomlError as error:
        raise BuildingFileError(error.problems) from None
    return _building(BuildingTable.model_validate(document), folder)


def _wrong_keys(document: Mapping[str, Any]) -> Iterator[Problem]:
    return wrong_keys(document, BuildingTable)


def _rows(document: Mapping[str, Any], name: str) -> list[Mapping[str, Any]]:
    """The tables of an array of tables, empty where there is none: what is wrong with it is told elsewhere."""
    rows = document.get(name)
    return [row if isinstance(row, dict) else {} for row in rows] if isinstance(rows, list) else []


def _duplicates(rows: list[Mapping[str, Any]], table: str, key: str) -> Iterator[Problem]:
    seen: dict[object, int] = {}
    for index, row in enumerate(rows):
        if isinstance(value := row.get(key), str) and seen.setdefault(value, index) != index:
            yield (table, index, key), f"{value!r} is taken by {table}[{seen[value] + 1}]; each needs its own"


def _wrong_levels(document: Mapping[str, Any]) -> Iterator[Problem]:
    """Levels out of order, twice, or without a mass."""
    levels = _rows(document, "level")
    yield from _duplicates(levels, "level", "name")
    for index, level in enumerate(levels):
        wanted, role = ("ground", "base")[index] if index < 2 else "floor", level.get("role", "floor")
        if role != wanted:
            yield (
                ("level", index, "role"),
                f"level {index + 1} from the ground up must be {wanted!r}, got {role!r}: first the ground below "
                f"the isolators, then the base slab just above them, then the floors",
            )
        if index > 0 and "mass" not in level:
            yield ("level", index), "mass is missing (kg)"
        if index < 2 and "stiffness" in level:
            yield ("level", index, "stiffness"), "only a floor has a storey below it; leave it out here"
        if index == 0 and "mass_uncertainty" in level:
            yield ("level", index, "mass_uncertainty"), "the ground has no mass; leave it out here"


def _wrong_gap(document: Mapping[str, Any]) -> Iterator[Problem]:
    """A gap that the layer closes before it reaches its design displacement."""
    isolation = document.get("isolation")
    if not isinstance(isolation, dict):
        return
    design, gap = isolation.get("design_displacement"), isolation.get("moat_clearance")
    if isinstance(design, int | float) and isinstance(gap, int | float) and gap < design:
        message = f"{gap:g} m is less than design_displacement, {design:g} m; check both"
        yield ("isolation", "moat_clearance"), f"{message}: the building must not reach the wall within its design"


def _wrong_source(document: Mapping[str, Any]) -> Iterator[Problem]:
    """A radius around nowhere."""
    source = document.get("source")
    placed = "latitude" in document and "longitude" in document
    if isinstance(source, dict) and "maximum_radius" in source and not placed:
        yield ("source", "maximum_radius"), "around where? give latitude and longitude at the top of the file"


def _wrong_addresses(document: Mapping[str, Any]) -> Iterator[Problem]:
    """Addresses at which no server can be asked; none of them is repeated, as it may hold a password."""
    source = document.get("source")
    if not isinstance(source, dict):
        return
    of_servers = ("location", "catalogue") if source.get("kind") in ("fdsnws", "archive") else ("catalogue",)
    for key in of_servers:
        if isinstance(address := source.get(key), str) and (problem := wrong_web_address(address)):
            yield ("source", key), problem


def _wrong_channels(document: Mapping[str, Any]) -> Iterator[Problem]:
    """Channels on no level, twice, without a direction, or in an absurd unit."""
    channels = _rows(document, "channel")
    names = [level["name"] for level in _rows(document, "level") if isinstance(level.get("name"), str)]
    yield from _duplicates(channels, "channel", "id")
    for index, channel in enumerate(channels):
        level, quantity = channel.get("level"), channel.get("quantity")
        if isinstance(level, str) and level not in names:
            yield ("channel", index, "level"), f"no level is named {level!r}; the levels are {', '.join(names)}"
        if quantity == "temperature" and "direction" in channel:
            yield ("channel", index, "direction"), "a temperature has none; leave it out"
        if quantity in ("acceleration", "velocity", "displacement") and "direction" not in channel:
            yield ("channel", index), "direction is missing (x, y or z)"
        yield from _wrong_unit(index, channel)
        yield from _wrong_rotation(index, channel, channels)


def _wrong_rotation(index: int, channel: Mapping[str, Any], channels: list[Mapping[str, Any]]) -> Iterator[Problem]:
    """Axes that are turned, but not as a pair."""
    if not channel.get("rotation"):
        return
    other = {"x": "y", "y": "x"}.get(str(channel.get("direction")))
    sensor = [channel.get(key) for key in ("level", "quantity", "position", "rotation")]
    beside = [[at.get(key) for key in ("level", "quantity", "position", "rotation")] for at in channels]
    pair = [at for at, found in zip(channels, beside, strict=True) if at.get("direction") == other and found == sensor]
    if len(pair) != 1:
        message = f"axes are turned in pairs, but {len(pair)} channels in direction {other or 'x or y'} have this level"
        yield ("channel", index, "rotation"), f"{message}, quantity, position and rotation; one would do"


def _wrong_unit(index: int, channel: Mapping[str, Any]) -> Iterator[Problem]:
    """A gain of 0, a unit without a gain, or one that cannot be the channel's."""
    gain, unit, quantity = channel.get("gain"), channel.get("unit"), channel.get("quantity")
    if gain == 0:
        yield ("channel", index, "gain"), "must not be 0: every sample would be"
    if unit is not None and gain is None:
        yield ("channel", index, "unit"), "a unit says what gain is in; give gain too (1.0 if samples are in the unit)"
    try:
        meant = unit_gain(unit).quantity if isinstance(unit, str) else quantity
    except FormatError:  # told with the key itself
        return
    if quantity is not None and meant != quantity:
        yield ("channel", index, "unit"), f"{unit!r} is a unit of {meant}, but this channel measures {quantity}"


def _wrong_receivers(document: Mapping[str, Any]) -> Iterator[Problem]:
    """Receivers that are there twice, or that nothing could reach; no secret is repeated."""
    receivers = _rows(document, "receiver")
    yield from _duplicates(receivers, "receiver", "name")
    for index, receiver in enumerate(receivers):
        kind, address, secret = str(receiver.get("kind")), receiver.get("address"), receiver.get("secret")
        if kind not in get_args(ReceiverKind):
            continue
        if isinstance(address, str) and address and (problem := wrong_address(kind, address)):
            yield ("receiver", index, "address"), problem
        if (secret is None or isinstance(secret, str)) and (problem := wrong_secret(kind, secret)):
            yield ("receiver", index, *(["secret"] if secret is not None else [])), problem


CHECKS: tuple[Check, ...] = (_wrong_keys, _wrong_levels, _wrong_gap, _wrong_source, _wrong_channels, _wrong_receivers)


def _building(table: BuildingTable, folder: Path) -> BuildingFile:
    design = IsolationDesign(**table.isolation.design.model_dump())
    description = BuildingDescription(
        code=table.code,
        name=table.name,
        levels=tuple(_level(level) for level in table.level),
        isolation=IsolationLayer(
            rubber_height=table.isolation.rubber_height,
            design=design,
            design_displacement=table.isolation.design_displacement,
            moat_clearance=table.isolation.moat_clearance,
        ),
        channels=tuple(_channel(channel) for channel in table.channel),
    )
    return BuildingFile(
        description=description,
        source=None if table.source is None else _source(table.source, folder),
        gains={channel.id: _gain(channel) for channel in table.channel if channel.gain is not None},
        latitude=table.latitude,
        longitude=table.longitude,
        timezone=table.timezone,
        receivers=tuple(_receiver(receiver) for receiver in table.receiver),
    )


def _level(table: LevelTable) -> Level:
    return Level(table.name, table.role, table.mass, table.stiffness, table.mass_uncertainty)


def _channel(table: ChannelTable) -> Channel:
    rotation = radians(table.rotation)
    return Channel(table.id, table.level, table.quantity, table.direction, table.position, rotation)


def _source(table: SourceTable, folder: Path) -> SourceFile:
    values = table.model_dump()
    if table.kind == "folder":
        values["location"] = str((folder / table.location).resolve())
    return SourceFile(**values)


def _receiver(table: ReceiverTable) -> ReceiverRule:
    return ReceiverRule(
        name=table.name,
        kind=table.kind,
        address=table.address,
        secret=table.secret,
        kinds=tuple(table.kinds or wanted_kinds(table.kind)),
        severities=tuple(table.severities or SEVERITIES),
    )


def _gain(channel: ChannelTable) -> Gain:
    unit = 1.0 if channel.unit is None else unit_gain(channel.unit).si_per_count
    return Gain((1.0 if channel.gain is None else channel.gain) * unit, channel.quantity)
