"""Keys of a building file, each with its type and meaning."""

from datetime import date, datetime
from typing import Annotated, Literal
from zoneinfo import ZoneInfo

from pydantic import AfterValidator, BeforeValidator, Field

from core.description import Role
from core.record import Direction, Quantity
from service.buildings.recipient_rules import MAIL, ReceiverKind, Severity, WantedKind
from service.formats.format_errors import FormatError
from service.formats.toml_problems import Table
from service.formats.units import unit_gain
from service.language.choice import ENGLISH, Language

OTHER_FILES = ("posix/", "right/", "posixrules")
"""Beginnings of names in a database of time zones that are not the IANA's, as in zoneinfo.available_timezones."""


def _timezone(name: str) -> str:
    """A name of the IANA database; its file is opened, since to list all files takes long."""
    try:
        ZoneInfo(name)
        is_zone = not name.startswith(OTHER_FILES)
    except (ValueError, LookupError, OSError):  # of a path, of an unknown name, and of a folder
        is_zone = False
    if not is_zone:
        raise ValueError(f"{name!r} is not a time zone of the IANA database, such as Asia/Tokyo")
    return name


def _unit(name: str) -> str:
    try:
        unit_gain(name)
    except FormatError as error:
        raise ValueError(str(error)) from None
    return name


def _renamed(severity: object) -> object:
    """Building files of earlier versions call the lowest severity `all_clear`."""
    return "normal" if severity == "all_clear" else severity


def _mail(address: str) -> str:
    if not MAIL.fullmatch(address):
        raise ValueError(f"{address!r} is not a mail address, such as engineer@example.org")
    return address


Named = Annotated[Severity, BeforeValidator(_renamed)]
Text = Annotated[str, Field(min_length=1)]
Line = Annotated[str, Field(min_length=1, max_length=100, pattern=r"^[^\x00-\x1f]*\S[^\x00-\x1f]*$")]
Positive = Annotated[float, Field(gt=0)]
Horizontal = Annotated[float, Field(gt=0, le=5)]
"""m, of a displacement or a gap: no isolator moves 5 m, and a number in mm is refused."""


class LevelTable(Table):
    """`[[level]]`: one level of the building, from the ground up."""

    name: Text = Field(description="the level's name, by which channels refer to it")
    role: Role = Field(
        default="floor",
        description="ground (below the isolators, first), base (the slab just above them, second) or floor",
    )
    mass: Positive | None = Field(default=None, description="kg; required for every level except the ground")
    stiffness: Positive | None = Field(default=None, description="N/m, design value of the storey below this floor")
    mass_uncertainty: Annotated[float, Field(ge=0, lt=1)] = Field(
        default=0.0,
        description="standard deviation of the mass over the mass, the total being right: 0.1 is 10 %; part of the "
        "bands of the force, k_eq and c_eq",
    )
    height: Positive | None = Field(
        default=None,
        description="m, of the storey below this floor; without it the storey's drift cannot be checked",
    )


class DesignTable(Table):
    """`[isolation.design]`: design values of the isolation layer."""

    k_b: Positive | None = Field(default=None, description="N/m, post-yield stiffness")
    c_b: Annotated[float, Field(ge=0)] | None = Field(default=None, description="N s/m, viscous damping coefficient")
    F_y: Positive | None = Field(default=None, description="N, yield force of the hysteretic part")
    D_y: Positive | None = Field(default=None, description="m, yield displacement of the hysteretic part")


class IsolationTable(Table):
    """`[isolation]`: the isolation layer."""

    rubber_height: Positive | None = Field(
        default=None, description="m, total thickness of the rubber: the displacement of 100 % shear strain"
    )
    design_displacement: Horizontal | None = Field(
        default=None,
        description="m, largest horizontal displacement that the layer is designed for; without it the displacement in "
        "an earthquake cannot be checked against the design",
    )
    moat_clearance: Horizontal | None = Field(
        default=None,
        description="m, smallest gap between the moving building and the surrounding wall; without it the displacement "
        "in an earthquake cannot be checked against the gap",
    )
    damper_stroke: Horizontal | None = Field(
        default=None, description="m, rated stroke of the dampers; leave it out where the layer has none"
    )
    rubber: Literal["natural", "high_damping", "lead"] | None = Field(
        default=None,
        description="natural, high_damping or lead (lead-rubber bearings): the compound, by which it hardens",
    )
    installed: date | None = Field(
        default=None, description="day when the bearings were installed; with `rubber` it gives the expected hardening"
    )
    design: DesignTable = Field(default=DesignTable(), description="design values")


class LimitTable(Table):
    """One entry of `[limits]`: the levels of one check, in the unit of its value, rising."""

    watch: Positive | None = Field(default=None, description="from this value on the verdict is at least watch")
    inspect: Positive | None = Field(default=None, description="from this value on the verdict is at least inspect")
    act: Positive | None = Field(default=None, description="from this value on the verdict is act")
    source: Text = Field(description="where the limits come from, as the verdict names it")


class LimitsTable(Table):
    """`[limits]`: the designer's limits in place of Menshin's defaults."""

    shear_strain: LimitTable | None = Field(default=None, description="largest displacement over rubber_height")
    design_displacement: LimitTable | None = Field(
        default=None, description="largest displacement over design_displacement"
    )
    moat_clearance: LimitTable | None = Field(default=None, description="largest displacement over moat_clearance")
    damper_stroke: LimitTable | None = Field(default=None, description="largest displacement over damper_stroke")
    damper_travel: LimitTable | None = Field(
        default=None,
        description="m, path of the isolators in all earthquakes together; without it the dampers' travel "
        "cannot be checked",
    )
    residual_displacement: LimitTable | None = Field(default=None, description="m, left by one earthquake")
    rest_position: LimitTable | None = Field(default=None, description="m, left by all earthquakes together")
    storey_drift: LimitTable | None = Field(default=None, description="drift over height, as in 0.002 for 1/500")
    floor_acceleration: LimitTable | None = Field(default=None, description="m/s², largest of any floor")
    jma_intensity: LimitTable | None = Field(
        default=None, description="JMA instrumental intensity at the ground, unofficial"
    )
    long_period_class: LimitTable | None = Field(
        default=None, description="class of long-period ground motion, 1 to 4, unofficial"
    )
    stiffness: LimitTable | None = Field(
        default=None,
        description="relative change of the isolators' stiffness at equal amplitude and temperature: inspect is the "
        "range that the maker gives",
    )


class SpectrumTable(Table):
    """`[design_spectrum]`: the designer's response spectrum, which reports show beside the measured one."""

    periods: Annotated[list[Positive], Field(min_length=2)] = Field(description="s, rising")
    acceleration: Annotated[list[Positive], Field(min_length=2)] = Field(
        description="m/s², response acceleration at 5 % damping, one for each period"
    )
    source: Text = Field(description="where the spectrum comes from, as reports name it")


class SourceTable(Table):
    """`[source]`: the building's monitoring server."""

    kind: Literal["folder", "fdsnws", "archive", "seedlink"] = Field(
        description="folder (of files), fdsnws (FDSN web services), archive (HTTP listing of event files) or seedlink "
        "(live stream; see streams.md)"
    )
    location: Text = Field(description="a path, relative to the building file, or the server's address")
    data: Literal["events", "continuous"] = Field(
        default="events",
        description="events (every file or answer is one earthquake's) or continuous (a trigger cuts the events)",
    )
    since: datetime | None = Field(default=None, description="date and time with offset; nothing older is fetched")
    catalogue: Text | None = Field(
        default=None,
        description="fdsnws only: address of an FDSN event service that names the earthquakes; default: location, "
        "if it offers one",
    )
    minimum_magnitude: float | None = Field(
        default=None, description="smallest earthquake requested from the catalogue"
    )
    maximum_radius: Annotated[float, Field(gt=0, le=180)] | None = Field(
        default=None, description="degrees, greatest distance of earthquakes requested from the catalogue"
    )
    before: Annotated[float, Field(ge=0)] = Field(
        default=30.0, description="s, fetched before an earthquake's origin time in the catalogue"
    )
    after: Positive = Field(default=300.0, description="s, fetched after an earthquake's origin time in the catalogue")


class ChannelTable(Table):
    """`[[channel]]`: one sensor component."""

    id: Annotated[str, Field(pattern=r"^[^.\s]*\.[^.\s]+\.[^.\s]*\.[^.\s]+$")] = Field(
        description="network, station, location and channel code as the records name it: XX.BNCS.01.HNX"
    )
    level: Text = Field(description="name of the level that the sensor sits on")
    direction: Direction | None = Field(
        default=None, description="x or y (horizontal) or z (up); required except for a temperature"
    )
    quantity: Quantity = Field(
        description="acceleration (absolute), velocity, displacement (relative to the ground) or temperature"
    )
    position: tuple[float, float] | None = Field(
        default=None,
        strict=False,  # TOML has no tuples
        description="m, [x, y] of the sensor from its level's centre of mass; gives the torsion where two sensors lie "
        "apart",
    )
    rotation: Annotated[float, Field(ge=-180, le=180)] = Field(
        default=0.0,
        description="degrees by which the sensor's x and y are turned against the building's, from x towards y; the "
        "same for both",
    )
    gain: float | None = Field(
        default=None,
        description="of `unit` per stored number; overrides StationXML; negative for a sensor mounted reversed",
    )
    unit: Annotated[str, AfterValidator(_unit)] | None = Field(
        default=None, description="unit of gain: m/s**2, cm/s**2, gal, g, m/s, cm/s, m, cm, mm, degC; default SI"
    )


class ReceiverTable(Table):
    """`[[receiver]]`: a person or program that receives messages on the building."""

    name: Annotated[str, Field(min_length=1, max_length=64)] = Field(description="the receiver's name, its own here")
    kind: ReceiverKind = Field(description="email, webhook, alertmanager or apprise (other chat services)")
    address: Text = Field(
        description="mail address, web address, or address of Apprise; `env:NAME` takes it from that variable of the "
        "environment"
    )
    secret: Text | None = Field(
        default=None,
        description="webhook only: key of its signature, whsec_ and the base64 of 24 to 64 bytes, or `env:NAME`",
    )
    kinds: Annotated[list[WantedKind], Field(min_length=1)] | None = Field(
        default=None,
        description="of event, alert, data (that stopped) and drill, the kinds of messages it receives; default: all, "
        "and all but event for an alertmanager",
    )
    severities: Annotated[list[Named], Field(min_length=1)] | None = Field(
        default=None, description="of normal, note, warning and alarm, the severities it receives; default: all"
    )
    report: bool = Field(
        default=False, description="email only: true to get the report on an earthquake, as PDF, with its messages"
    )
    language: Language = Field(
        default=ENGLISH,
        description="email and apprise only: language of its messages and reports, en (English) or ja (Japanese)",
    )


class ContactTable(Table):
    """`[[contact]]`: a person or an office to call about the building."""

    name: Line = Field(description="of the person or office")
    role: Line = Field(description="what they do for the building, as in structural engineer")
    phone: Annotated[str, Field(max_length=40, pattern=r"^\+?[0-9][0-9 ()./-]{1,37}[0-9]$")] | None = Field(
        default=None, description="telephone number: digits, with a leading + for a country, spaces, (, ), ., / and -"
    )
    mail: Annotated[str, AfterValidator(_mail)] | None = Field(default=None, description="mail address")


class BuildingTable(Table):
    """The top of the file: the building."""

    code: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$", max_length=32)] = Field(
        description="short name in addresses and tables: letters, digits, - and _"
    )
    name: Text = Field(description="the building's name")
    latitude: Annotated[float, Field(ge=-90, le=90)] | None = Field(default=None, description="degrees, north positive")
    longitude: Annotated[float, Field(ge=-180, le=180)] | None = Field(
        default=None, description="degrees, east positive"
    )
    timezone: Annotated[str, AfterValidator(_timezone)] = Field(
        default="UTC", description="IANA name, for times as people there read them"
    )
    level: Annotated[list[LevelTable], Field(min_length=3)] = Field(description="levels from the ground up")
    isolation: IsolationTable = Field(default=IsolationTable(), description="the isolation layer")
    limits: LimitsTable = Field(default=LimitsTable(), description="limits of the verdict's checks")
    design_spectrum: SpectrumTable | None = Field(
        default=None, description="the design's response spectrum at the ground, for reports"
    )
    source: SourceTable | None = Field(default=None, description="where records are fetched")
    channel: Annotated[list[ChannelTable], Field(min_length=1)] = Field(description="the sensors")
    receiver: list[ReceiverTable] = Field(default=[], description="recipients of messages; see messages.md")
    contact: list[ContactTable] = Field(
        default=[], description="people to call, in this order; the first page and the building's page show them"
    )
