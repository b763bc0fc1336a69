"""Checks of a building file that go beyond its keys and types: each yields the problems it finds."""

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Any, get_args

from service.addresses import stream_address_problem, web_address_problem
from service.buildings.description_keys import BuildingTable
from service.buildings.recipient_rules import ReceiverKind, wrong_address, wrong_language, wrong_report, wrong_secret
from service.formats.format_errors import FormatError
from service.formats.toml_problems import Check, Problem, wrong_keys
from service.formats.units import unit_gain


def _wrong_keys(document: Mapping[str, Any]) -> Iterator[Problem]:
    return wrong_keys(document, BuildingTable)


def _rows(document: Mapping[str, Any], name: str) -> list[Mapping[str, Any]]:
    """The tables of an array of tables, empty where there is none: wrong types are reported elsewhere."""
    rows = document.get(name)
    return [row if isinstance(row, dict) else {} for row in rows] if isinstance(rows, list) else []


def _duplicates(rows: list[Mapping[str, Any]], table: str, key: str) -> Iterator[Problem]:
    seen: dict[object, int] = {}
    for index, row in enumerate(rows):
        if isinstance(value := row.get(key), str) and seen.setdefault(value, index) != index:
            yield (table, index, key), f"{value!r} is already used by {table}[{seen[value] + 1}]; each needs its own"


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
        for key in ("stiffness", "height"):
            if index < 2 and key in level:
                yield ("level", index, key), "only a floor has a storey below it; leave it out here"
        if index == 0 and "mass_uncertainty" in level:
            yield ("level", index, "mass_uncertainty"), "the ground has no mass; leave it out here"


def _wrong_gap(document: Mapping[str, Any]) -> Iterator[Problem]:
    """A gap smaller than the design displacement."""
    isolation = document.get("isolation")
    if not isinstance(isolation, dict):
        return
    design, gap = isolation.get("design_displacement"), isolation.get("moat_clearance")
    if isinstance(design, int | float) and isinstance(gap, int | float) and gap < design:
        message = f"{gap:g} m is less than design_displacement, {design:g} m; check both"
        yield ("isolation", "moat_clearance"), f"{message}: the building must not reach the wall within its design"


def _wrong_spectrum(document: Mapping[str, Any]) -> Iterator[Problem]:
    """A design spectrum whose lists do not fit each other, or whose periods do not rise."""
    spectrum = document.get("design_spectrum")
    lists = [spectrum.get(name) if isinstance(spectrum, dict) else None for name in ("periods", "acceleration")]
    periods, acceleration = (one if isinstance(one, list) else [] for one in lists)
    if len(periods) != len(acceleration):
        message = f"{len(acceleration)} values for {len(periods)} periods; give one for each"
        yield ("design_spectrum", "acceleration"), message
    numbers = [one for one in periods if isinstance(one, int | float)]
    if any(later <= earlier for earlier, later in pairwise(numbers)):
        yield ("design_spectrum", "periods"), "the periods must rise"


def _wrong_limits(document: Mapping[str, Any]) -> Iterator[Problem]:
    """Limits without a level, or that do not rise from watch to inspect to act."""
    limits = document.get("limits")
    for check, levels in limits.items() if isinstance(limits, dict) else ():
        if not isinstance(levels, dict):
            continue
        given = [(name, levels[name]) for name in ("watch", "inspect", "act") if name in levels]
        numbers = [(name, value) for name, value in given if isinstance(value, int | float)]
        if not given:
            yield ("limits", check), "gives no level; give watch, inspect or act, or leave it out for the defaults"
        for (lower, low), (upper, high) in pairwise(numbers):
            if high <= low:
                yield ("limits", check, upper), f"{high:g} must be above {lower}, {low:g}"
        if check == "long_period_class":
            for name, value in numbers:
                if value not in (1, 2, 3, 4):
                    yield ("limits", check, name), f"the classes are 1, 2, 3 and 4, got {value:g}"


def _wrong_source(document: Mapping[str, Any]) -> Iterator[Problem]:
    """A radius without a centre; channels that no live stream has."""
    source = document.get("source")
    if isinstance(source, dict) and source.get("kind") == "seedlink":
        if source.get("data", "events") != "events":
            yield ("source", "data"), "the trigger cuts the events out of every live stream; leave data out"
        for index, channel in enumerate(_rows(document, "channel")):
            if isinstance(name := channel.get("id"), str) and name.count(".") != 3:
                yield (
                    ("channel", index, "id"),
                    f"{name!r} is not network, station, location and channel, as streams need",
                )
    placed = "latitude" in document and "longitude" in document
    if isinstance(source, dict) and "maximum_radius" in source and not placed:
        yield ("source", "maximum_radius"), "needs a centre; give latitude and longitude at the top of the file"


def wrong_addresses(document: Mapping[str, Any]) -> Iterator[Problem]:
    """Invalid addresses of servers; none is repeated, because it may contain a password."""
    source = document.get("source")
    if not isinstance(source, dict):
        return
    of_servers = ("location", "catalogue") if source.get("kind") in ("fdsnws", "archive") else ("catalogue",)
    for key in of_servers:
        if isinstance(address := source.get(key), str) and (problem := web_address_problem(address)):
            yield ("source", key), problem
    address = source.get("location")
    is_stream = source.get("kind") == "seedlink" and isinstance(address, str)
    if is_stream and (problem := stream_address_problem(str(address))):
        yield ("source", "location"), problem


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
    pair = [at for at, place in zip(channels, beside, strict=True) if at.get("direction") == other and place == sensor]
    if len(pair) != 1:
        message = f"axes are turned in pairs, but {len(pair)} channels in direction {other or 'x or y'} have this level"
        yield ("channel", index, "rotation"), f"{message}, quantity, position and rotation; keep one"


def _wrong_unit(index: int, channel: Mapping[str, Any]) -> Iterator[Problem]:
    """A gain of 0, a unit without a gain, or one that cannot be the channel's."""
    gain, unit, quantity = channel.get("gain"), channel.get("unit"), channel.get("quantity")
    if gain == 0:
        yield ("channel", index, "gain"), "must not be 0: every sample would be"
    if unit is not None and gain is None:
        yield ("channel", index, "unit"), "a unit says what gain is in; give gain too (1.0 if samples are in the unit)"
    try:
        meant = unit_gain(unit).quantity if isinstance(unit, str) else quantity
    except FormatError:  # reported with the key itself
        return
    if quantity is not None and meant != quantity:
        yield ("channel", index, "unit"), f"{unit!r} is a unit of {meant}, but this channel measures {quantity}"


def _wrong_receivers(document: Mapping[str, Any]) -> Iterator[Problem]:
    """Duplicate or unreachable receivers; no secret is repeated."""
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
        if problem := wrong_report(kind, receiver.get("report")):
            yield ("receiver", index, "report"), problem
        if problem := wrong_language(kind, receiver.get("language")):
            yield ("receiver", index, "language"), problem


def _unreachable_contacts(document: Mapping[str, Any]) -> Iterator[Problem]:
    """Contacts without a telephone number and a mail address."""
    for index, contact in enumerate(_rows(document, "contact")):
        if contact and not {"phone", "mail"} & contact.keys():
            yield ("contact", index), "gives neither phone nor mail; give one of them"


CHECKS: tuple[Check, ...] = (
    _wrong_keys,
    _wrong_levels,
    _wrong_gap,
    _wrong_limits,
    _wrong_spectrum,
    _wrong_source,
    _wrong_channels,
    _wrong_receivers,
    _unreachable_contacts,
)
"""Checks of every file; `wrong_addresses` is for new ones only."""
