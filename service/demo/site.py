"""The simulated building in the words of its engineer and its monitoring server: levels, sensors, digitizer."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from obspy import Inventory, UTCDateTime
from obspy.core.inventory import Channel, InstrumentSensitivity, Network, Response, ResponseStage, Site, Station

from core.paper import BUILDING, ISOLATOR
from core.record import Direction, Quantity

CODE, NAME = "DEMO", "Simulated building of the paper"
NETWORK = "XX"  # not a registered network
LATITUDE, LONGITUDE, ELEVATION = 35.556, 139.654, 30.0  # Hiyoshi, the site of the paper's record
TIMEZONE = "Asia/Tokyo"
RATE = 100.0  # Hz
RUBBER_HEIGHT = 0.2  # m, displacement of 100 % shear strain (paper, section 8)
DESIGN_DISPLACEMENT, MOAT_CLEARANCE = 0.4, 0.5  # m, assumed: 200 % shear strain plus a quarter
STOREY_HEIGHT = 4.0  # m, assumed
LIMITS = """\
[limits]
storey_drift = { watch = 0.007, inspect = 0.0085, act = 0.01, source = "assumption of the demonstration" }
floor_acceleration = { watch = 7.0, inspect = 8.5, act = 10.0, source = "assumption of the demonstration" }
jma_intensity = { watch = 5.0, inspect = 6.0, source = "assumption of the demonstration" }
long_period_class = { watch = 4, source = "assumption of the demonstration" }"""
"""Assumed: a building that is designed for intensity 6-lower, and whose superstructure stays elastic."""
CONTACTS = """\
[[contact]]
name = "Engineer on call"
role = "structural engineer"
phone = "+81 3 0000 0100"
mail = "engineer@example.org"
[[contact]]
name = "Control room"
role = "building management"
phone = "+81 3 0000 0200\""""
"""Numbers that no telephone has."""
GROUND, BASE, FLOORS = "ground", "1F", ("2F", "3F", "4F", "5F", "6F", "7F", "roof")
DIRECTIONS: tuple[Direction, ...] = ("x", "y")
BEFORE_ORIGIN, AFTER_ORIGIN = 30.0, 180.0  # s, length that covers every record of the demonstration
OPENED = UTCDateTime(2000, 1, 1)
UNITS = {"acceleration": "M/S**2", "displacement": "M", "temperature": "degC"}
INSTRUMENTS = {"acceleration": "N", "displacement": "Y", "temperature": "K"}
"""Second letter of a channel's code (SEED)."""


@dataclass(frozen=True, slots=True)
class Sensor:
    """One sensor component with its digitizer."""

    level: str
    direction: Direction | None
    """None for a thermometer."""
    quantity: Quantity
    location: str
    """Location code."""
    noise: float
    """SI units, standard deviation."""
    resolution: float
    """SI units per count."""

    @property
    def channel(self) -> str:
        """Channel code; a thermometer's ends with O (outside)."""
        return f"H{INSTRUMENTS[self.quantity]}{(self.direction or 'o').upper()}"

    @property
    def id(self) -> str:
        """Network, station, location and channel code."""
        return f"{NETWORK}.{CODE}.{self.location}.{self.channel}"


def sensors() -> Iterator[Sensor]:
    """The paper's sensors: accelerometers at ground, first floor, fourth storey and roof, and a displacement
    transducer."""
    for direction in DIRECTIONS:
        for location, level in enumerate((GROUND, BASE, "4F", "roof")):
            # 0.01 gal is a good servo accelerometer; ±2 g over 24 bit
            yield Sensor(level, direction, "acceleration", f"0{location}", 1e-4, 4 * 9.80665 / 2**24)
        # 0.02 mm is a good laser or wire transducer; ±0.5 m over 24 bit
        yield Sensor(BASE, direction, "displacement", "01", 2e-5, 1.0 / 2**24)


SENSORS = tuple(sensors())
THERMOMETER = Sensor(GROUND, None, "temperature", "10", 0.2, 1e-3)
"""A thermometer among the isolators, with the 0.2 °C of an ordinary instrument."""


def building_file(server: str, installed: Sequence[Sensor] = SENSORS) -> str:
    """The building file, with the address of its monitoring server."""
    masses = (BUILDING.base_mass, *BUILDING.floor_mass)
    stiffnesses = (None, *BUILDING.storey_stiffness)
    lines = [
        f'code = "{CODE}"',
        f'name = "{NAME}"',
        f"latitude = {LATITUDE}",
        f"longitude = {LONGITUDE}",
        f'timezone = "{TIMEZONE}"',
        f'[[level]]\nname = "{GROUND}"\nrole = "ground"',
    ]
    for name, mass, stiffness in zip((BASE, *FLOORS), masses, stiffnesses, strict=True):
        design = f"\nstiffness = {stiffness:.6g}\nheight = {STOREY_HEIGHT}" if stiffness else ""
        lines.append(
            f'[[level]]\nname = "{name}"\nrole = "{"floor" if stiffness else "base"}"\nmass = {mass:.1f}{design}'
        )
    layer = ISOLATOR.effects
    lines += [
        f"[isolation]\nrubber_height = {RUBBER_HEIGHT}",
        f"design_displacement = {DESIGN_DISPLACEMENT}\nmoat_clearance = {MOAT_CLEARANCE}",
        LIMITS,
        "[isolation.design]",
        f"k_b = {layer['elastic']['k_b']:.1f}",
        f"c_b = {layer['viscous']['c_b']:.1f}",
        f"F_y = {layer['bouc_wen']['F_y']:.1f}",
        f"D_y = {layer['bouc_wen']['D_y']}",
        f'[source]\nkind = "fdsnws"\nlocation = "{server}"\nbefore = {BEFORE_ORIGIN}\nafter = {AFTER_ORIGIN}',
    ]
    lines += [
        f'[[channel]]\nid = "{s.id}"\nlevel = "{s.level}"\n'
        + (f'direction = "{s.direction}"\n' if s.direction else "")
        + f'quantity = "{s.quantity}"'
        for s in installed
    ]
    return "\n".join([*lines, CONTACTS]) + "\n"


def inventory(installed: Sequence[Sensor] = SENSORS) -> Inventory:
    """StationXML of the building's channels."""
    station = Station(CODE, LATITUDE, LONGITUDE, ELEVATION, site=Site(NAME), start_date=OPENED, creation_date=OPENED)
    station.channels = [_channel(sensor) for sensor in installed]
    return Inventory([Network(NETWORK, [station], description="of no registered network")], source="menshin demo")


def _channel(sensor: Sensor) -> Channel:
    counts = 1.0 / sensor.resolution
    unit = UNITS[sensor.quantity]
    return Channel(
        sensor.channel,
        sensor.location,
        LATITUDE,
        LONGITUDE,
        elevation=ELEVATION,
        depth=0.0,
        azimuth=90.0 if sensor.direction == "x" else 0.0,
        dip=0.0,
        sample_rate=RATE,
        start_date=OPENED,
        description=f"{sensor.level}, {sensor.quantity} {sensor.direction or ''}".strip(),
        response=Response(
            instrument_sensitivity=InstrumentSensitivity(counts, 1.0, unit, "COUNTS"),
            response_stages=[ResponseStage(1, counts, 1.0, unit, "COUNTS")],
        ),
    )
