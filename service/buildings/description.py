"""Building files: TOML in; a building, or every problem of the file, out."""

import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from math import radians
from pathlib import Path
from typing import Literal

from core.description import BuildingDescription, IsolationDesign, IsolationLayer, Level
from core.record import Channel
from service.buildings.description_checks import CHECKS, wrong_addresses
from service.buildings.description_keys import (
    BuildingTable,
    ChannelTable,
    LevelTable,
    ReceiverTable,
    SourceTable,
    SpectrumTable,
)
from service.buildings.recipient_rules import SEVERITIES, ReceiverRule, wanted_kinds
from service.formats.toml_problems import Check, TomlError, checked
from service.formats.units import Gain, unit_gain


class BuildingFileError(TomlError):
    """Every problem of a building file, one a line, each with its line and key."""


@dataclass(frozen=True, slots=True)
class SourceFile:
    """The source of the building's records; docs/operate/building.md describes the keys."""

    kind: Literal["folder", "fdsnws", "archive", "seedlink"]
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
class GivenLimits:
    """The designer's limits of one check, in the unit of its value; None where there is none of that level."""

    watch: float | None
    inspect: float | None
    act: float | None
    source: str


@dataclass(frozen=True, slots=True)
class DesignSpectrum:
    """The design's response spectrum at the ground, 5 % damping."""

    periods: tuple[float, ...]
    """s, rising."""
    acceleration: tuple[float, ...]
    """m/s², one for each period."""
    source: str


@dataclass(frozen=True, slots=True)
class Contact:
    """A person or an office to call about the building."""

    name: str
    role: str
    phone: str | None
    mail: str | None

    @property
    def dialled(self) -> str:
        """The telephone number as a telephone dials it."""
        return re.sub(r"[^+0-9]", "", self.phone or "")


@dataclass(frozen=True, slots=True)
class BuildingFile:
    """A building, its monitoring server, the gains of its channels and the limits of its checks."""

    description: BuildingDescription
    source: SourceFile | None
    gains: Mapping[str, Gain]
    """By channel id, where the file gives one; these override StationXML."""
    latitude: float | None
    longitude: float | None
    timezone: str
    """IANA name."""
    receivers: tuple[ReceiverRule, ...]
    limits: Mapping[str, GivenLimits]
    """By check, where the file gives them."""
    design_spectrum: DesignSpectrum | None = None
    contacts: tuple[Contact, ...] = ()
    """In the order in which they are to be called."""


def read(text: str, folder: Path) -> BuildingFile:
    """The building that a file describes.

    Args:
        text: the file.
        folder: of the file; a relative source location starts here.

    Raises:
        BuildingFileError: with every problem of the file, not only the first.
    """
    return _read(text, folder, CHECKS)


def read_new(text: str, folder: Path) -> BuildingFile:
    """The building that a new file describes, whose addresses must be valid, too.

    A file that was accepted by an earlier version may keep invalid ones.
    """
    return _read(text, folder, (*CHECKS, wrong_addresses))


def stored(text: str) -> str:
    """The tables of a valid file as JSON, which `restored` reads without parsing TOML and checking it again."""
    return BuildingTable.model_validate(tomllib.loads(text)).model_dump_json(exclude_unset=True)


def restored(document: str, folder: Path) -> BuildingFile:
    """The building of a file whose tables were stored.

    Args:
        document: as `stored` gives.
        folder: of the file.

    Raises:
        ValidationError: it was stored by a version with other keys.
    """
    return _building(BuildingTable.model_validate_json(document), folder)


def _read(text: str, folder: Path, checks: Sequence[Check]) -> BuildingFile:
    try:
        document = checked(text, checks)
    except TomlError as error:
        raise BuildingFileError(error.problems) from None
    return _building(BuildingTable.model_validate(document), folder)


def _building(table: BuildingTable, folder: Path) -> BuildingFile:
    design = IsolationDesign(**table.isolation.design.model_dump())
    spectrum = table.design_spectrum
    description = BuildingDescription(
        code=table.code,
        name=table.name,
        levels=tuple(_level(level) for level in table.level),
        isolation=IsolationLayer(
            rubber_height=table.isolation.rubber_height,
            design=design,
            design_displacement=table.isolation.design_displacement,
            moat_clearance=table.isolation.moat_clearance,
            damper_stroke=table.isolation.damper_stroke,
            rubber=table.isolation.rubber,
            installed=table.isolation.installed,
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
        limits={name: GivenLimits(**levels.model_dump()) for name, levels in table.limits if levels is not None},
        design_spectrum=None if spectrum is None else _spectrum(spectrum),
        contacts=tuple(Contact(**contact.model_dump()) for contact in table.contact),
    )


def _level(table: LevelTable) -> Level:
    return Level(table.name, table.role, table.mass, table.stiffness, table.mass_uncertainty, table.height)


def _channel(table: ChannelTable) -> Channel:
    rotation = radians(table.rotation)
    return Channel(table.id, table.level, table.quantity, table.direction, table.position, rotation)


def _source(table: SourceTable, folder: Path) -> SourceFile:
    values = table.model_dump()
    if table.kind == "folder":
        values["location"] = str((folder / table.location).resolve())
    return SourceFile(**values)


def _spectrum(table: SpectrumTable) -> DesignSpectrum:
    return DesignSpectrum(tuple(table.periods), tuple(table.acceleration), table.source)


def _receiver(table: ReceiverTable) -> ReceiverRule:
    return ReceiverRule(
        name=table.name,
        kind=table.kind,
        address=table.address,
        secret=table.secret,
        kinds=tuple(table.kinds or wanted_kinds(table.kind)),
        severities=tuple(table.severities or SEVERITIES),
        report=table.report,
        language=table.language,
    )


def _gain(channel: ChannelTable) -> Gain:
    unit = 1.0 if channel.unit is None else unit_gain(channel.unit).si_per_count
    return Gain((1.0 if channel.gain is None else channel.gain) * unit, channel.quantity)


class LevelError(Exception):
    """Unknown levels, or levels that no analysis can use."""


def named_levels(names: Iterable[str], description: BuildingDescription) -> tuple[str, ...]:
    """Names of the levels to use, each once.

    Args:
        names: names of levels, or the roles `ground`, `base` and `roof`; a level of such a name goes first.
        description: of the building.

    Raises:
        LevelError: a level is unknown, or the base slab or every level above it is missing.
    """
    roles = {"ground": description.ground.name, "base": description.base.name, "roof": description.floors[-1].name}
    known = roles | {level.name: level.name for level in description.levels}
    wanted = list(names)
    for name in wanted:
        if name not in known:
            raise LevelError(f"no level {name!r}; there are {', '.join(known)}")
    levels = tuple(dict.fromkeys(known[name] for name in wanted))
    if description.base.name not in levels:
        raise LevelError("the base slab must be among them, as in base,roof")
    if not {floor.name for floor in description.floors} & set(levels):
        raise LevelError("a level above the base slab must be among them, as in base,roof")
    return levels
