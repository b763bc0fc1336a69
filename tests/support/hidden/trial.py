"""One trial: a building in which something is hidden, and the records of its earthquakes, from a case and a seed."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import datetime, timedelta

import numpy as np

from core.arrays import Matrix, Vector
from core.description import BuildingDescription
from core.record import Channel, Record
from hidden.building import GRAVITY, Building, building
from hidden.case import Case, parse_case
from hidden.description import LEVELS, describe
from hidden.faults import KINDS, Fault, faulty
from hidden.integration import Cube, Hidden, Response
from hidden.law import Need
from hidden.plan import FITTED, PEAKS, Plan, plans, shaking
from hidden.sensors import RATE, Noise, displacement_reading, late, noise, sampled
from hidden.strength import misfit_of, scaled_to_misfit, scaled_to_peaks, simulate_events, with_usual_yielding

FINE = 1000.0
"""Hz, steps of the integration."""
MISFIT = (0.01, 0.15)
"""Range of `misfit` that hidden laws are made strong enough for, each alone; some cannot be."""
USUAL = 0.25
"""Chance that motion along y, vertical motion, or temperature is there and recorded though no law needs it."""
NEEDS: tuple[Need, ...] = ("cross", "vertical", "temperature")


@dataclass(frozen=True, slots=True, eq=False)
class Event:
    """One earthquake: what was recorded of it, and what happened at the record's samples, without error."""

    record: Record
    displacement: Matrix
    """(axes, n) m, of the slab relative to the ground; x first, and y where it moves."""
    velocity: Matrix
    """(axes, n) m/s."""
    force: Matrix
    """(axes, n) N, of the isolation layer."""
    acceleration: Cube
    """(axes, 1 + floors, n) m/s², absolute, the base slab first."""
    ground: Matrix
    """(axes, n) m/s²."""
    vertical: Vector
    """(n,) m/s², of the base slab, upwards."""
    temperature: float
    """°C."""

    @property
    def start(self) -> datetime:
        """Start of the record."""
        return self.record.start


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """Everything that is known of a trial."""

    case: str
    seed: int
    hidden: tuple[Hidden, ...]
    """The hidden laws with their values; none if nothing is hidden."""
    faults: tuple[Fault, ...]
    softened: str
    """Floor above the storey that is softer than described; empty if none is."""
    building: Building
    description: BuildingDescription
    noise: Noise
    events: tuple[Event, ...]
    """By date; the first FITTED are for fitting, the last for predicting."""
    misfit: float
    """Misfit: change of the force by the hidden laws, over the force; see hidden.misfit."""

    @property
    def effects(self) -> tuple[str, ...]:
        """Names, in the workbench's library, of what is hidden; empty for a law that it has not."""
        return tuple(law.effect for law, _ in self.hidden)

    @property
    def fitted(self) -> tuple[Event, ...]:
        """The earthquakes for fitting."""
        return self.events[:FITTED]


def trial(text: str, seed: int) -> Trial:
    """The trial of that case (see hidden.case) and seed: the same each time."""
    wanted, rng = parse_case(text), np.random.default_rng([seed, *text.encode()])
    true = building(rng, max(PEAKS))
    earthquakes = plans(rng)
    happens = _happens(wanted, rng)
    begin = scaled_to_peaks(
        true, with_usual_yielding(true, ()), earthquakes, [60.0 * plan.peak for plan in earthquakes], happens
    ).scales
    hidden = tuple(
        scaled_to_misfit(true, (law, law.values(true.layer, rng)), earthquakes, begin, happens, _wanted(rng))
        for law in wanted.laws
    )
    laws = with_usual_yielding(true, hidden)
    scales = scaled_to_peaks(true, laws, earthquakes, begin, happens).scales
    found = simulate_events(true, laws, earthquakes, scales, FINE, happens)
    description, softened = _softened(describe(true, wanted, happens, rng), wanted, rng)
    faults = _faults(wanted, description, rng)
    noisy = Noise(float(rng.choice([0.01, 0.03, 0.1])), wanted.pink, wanted.resolution)
    gains = 1 + wanted.gain_error * rng.standard_normal(len(description.channels))
    clocks = np.random.default_rng([seed, *text.encode(), 0])  # its own: other draws are the same without it
    delays = wanted.clock_error * clocks.standard_normal(len(description.channels))
    events = tuple(
        _recorded(_exact(plan, scale, answer, happens), description, noisy, gains, delays, faults, wanted, rng)
        for plan, scale, answer in zip(earthquakes, scales, found.answers, strict=True)
    )
    return Trial(
        text,
        seed,
        hidden,
        faults,
        softened,
        true,
        description,
        noisy,
        events,
        misfit_of(found, every=round(FINE / RATE)),
    )


def _wanted(rng: np.random.Generator) -> float:
    return float(np.exp(rng.uniform(*np.log(MISFIT))))


def _happens(wanted: Case, rng: np.random.Generator) -> frozenset[Need]:
    needed = {need for law in wanted.laws for need in law.needs}
    needed |= {"cross" for kind, _ in wanted.faults if kind == "rotation"}
    return frozenset(need for need in NEEDS if rng.random() < USUAL or need in needed)


def _softened(
    description: BuildingDescription, wanted: Case, rng: np.random.Generator
) -> tuple[BuildingDescription, str]:
    """The description with one storey stiffer than the true one, by what that has lost."""
    lost, storey = rng.uniform(*wanted.softened), int(rng.integers(len(description.floors)))
    if not lost:
        return description, ""
    floor = description.floors[storey]
    stiffer = replace(floor, stiffness=(floor.stiffness or 0.0) / (1 - lost))
    levels = tuple(stiffer if level is floor else level for level in description.levels)
    return replace(description, levels=levels), floor.name


def _faults(wanted: Case, description: BuildingDescription, rng: np.random.Generator) -> tuple[Fault, ...]:
    def channel(level: str, direction: str) -> str:
        """Id of the accelerometer, or of the displacement sensor."""
        quantity = "displacement" if level == "displacement" else "acceleration"
        place = "1F" if level == "displacement" else level
        return next(
            c.id for c in description.channels if (c.level, c.quantity, c.direction) == (place, quantity, direction)
        )

    others = {"swap": lambda level: channel("RF", "x"), "rotation": lambda level: channel(level, "y")}
    return tuple(
        Fault(kind, channel(level, "x"), KINDS[kind].drawn(rng), others[kind](level) if kind in others else "")
        for kind, level in wanted.faults
    )


def _exact(plan: Plan, scale: float, answer: Response, happens: frozenset[Need]) -> Event:
    """Error-free response at the record's samples, without a record yet."""
    driven = shaking(plan, scale, FINE, happens)
    return Event(
        Record(plan.start, RATE, (), np.zeros((0, 0))),
        *(
            sampled(series, FINE)
            for series in (answer.displacement, answer.velocity, answer.force, answer.acceleration)
        ),
        ground=sampled(driven.ground, FINE),
        vertical=GRAVITY * sampled(driven.vertical, FINE),
        temperature=driven.temperature,
    )


def _recorded(
    event: Event,
    description: BuildingDescription,
    noisy: Noise,
    gains: Vector,
    delays: Vector,
    faults: tuple[Fault, ...],
    wanted: Case,
    rng: np.random.Generator,
) -> Event:
    samples = np.array([reading(channel, event, noisy, rng) for channel in description.channels])
    is_acceleration = np.array([channel.quantity == "acceleration" for channel in description.channels])
    samples[is_acceleration] *= gains[is_acceleration, None]
    if wanted.clock_error:
        samples = np.array([late(row, delay) for row, delay in zip(samples, delays, strict=True)])
    for fault in faults:
        samples = faulty(samples, description.channels, fault, rng)
    whole = replace(event, record=replace(event.record, channels=description.channels, samples=samples))
    return _cut(whole) if wanted.moving else whole


def reading(channel: Channel, event: Event, noisy: Noise, rng: np.random.Generator) -> Vector:
    """(n,) samples of a channel, with noise."""
    if channel.quantity == "temperature":
        return event.temperature + 0.1 * rng.standard_normal(event.vertical.size)
    if channel.quantity == "displacement":
        return displacement_reading(event.displacement["xy".index(str(channel.direction))], noisy.resolution, rng)
    exact = _acceleration(channel, event)
    return exact + noise(noisy, float(np.sqrt(np.mean(exact**2))), exact.size, rng)


def _acceleration(channel: Channel, event: Event) -> Vector:
    if channel.direction == "z":
        return event.vertical
    axis = "xy".index(str(channel.direction))
    return event.ground[axis] if channel.level == "ground" else event.acceleration[axis, LEVELS.index(channel.level)]


def _cut(event: Event) -> Event:
    """From where a twentieth of the slab's motion has passed."""
    passed = np.cumsum(event.acceleration[0, 0] ** 2)
    first = int(np.searchsorted(passed, 0.05 * passed[-1]))
    start = event.record.start + timedelta(seconds=first / RATE)
    names = ("displacement", "velocity", "force", "acceleration", "ground", "vertical")
    series: Mapping[str, np.ndarray] = {name: getattr(event, name)[..., first:] for name in names}
    return replace(event, record=replace(event.record, start=start, samples=event.record.samples[:, first:]), **series)
