"""One trial: a building in which something is hidden, and the records of its earthquakes, from a case and a seed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta

import numpy as np

from core.arrays import Matrix, Vector
from core.description import BuildingDescription, IsolationDesign, IsolationLayer, Level
from core.record import Channel, Record
from hidden.building import Building, building
from hidden.catalogue import LAWS
from hidden.ground import DURATION, MOTIONS, motion
from hidden.integration import Answer, Hidden, Shaking, kept, shaken
from hidden.law import Law, Layer
from hidden.misfit import misfit
from hidden.sensors import RATE, Noise, displacement_reading, noise, sampled

START = datetime(2019, 3, 5, 6, 7, 8, tzinfo=UTC)
"""Of the first earthquake."""
PEAKS = (0.004, 0.020, 0.080, 0.030, 0.050)
"""m, that the isolation layer about reaches in the earthquakes, by date; the last is kept out of every fit."""
FITTED = 4
"""How many of them are for fitting."""
FINE, COARSE = 1000.0, 250.0
"""Hz, steps of the integration: for the records, and for finding how strong ground motions and effects must be."""
FLOORS = ("2F", "3F", "4F", "5F", "6F", "7F", "RF")
INSTRUMENTED = ("1F", "4F", "RF")
"""Levels with an accelerometer besides the ground, as the paper has them."""
MISFIT = (0.01, 0.15)
"""Range of `misfit` that effects are made strong enough for."""


@dataclass(frozen=True, slots=True, eq=False)
class Event:
    """One earthquake: what happened and what was recorded of it."""

    start: datetime
    record: Record
    displacement: Matrix
    """(axes, n) m, exact, at the record's samples; so are all below."""
    velocity: Matrix
    """(axes, n) m/s."""
    force: Matrix
    """(axes, n) N."""
    acceleration: np.ndarray[tuple[int, int, int], np.dtype[np.float64]]
    """(axes, 1 + floors, n) m/s², absolute, the base slab first."""
    ground: Matrix
    """(axes, n) m/s²."""
    temperature: float
    """°C."""


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """Everything known of a trial."""

    case: str
    seed: int
    hidden: tuple[Hidden, ...]
    """The hidden laws with their values; none if nothing is hidden."""
    building: Building
    described: BuildingDescription
    noise: Noise
    events: tuple[Event, ...]
    """By date; the first FITTED are for fitting."""
    misfit: float
    """What hidden.misfit makes of the fitted events' x axis."""

    @property
    def effects(self) -> tuple[str, ...]:
        """Names in the workbench's library of what is hidden."""
        return tuple(law.effect for law, _ in self.hidden)


@dataclass(frozen=True, slots=True)
class Plan:
    """The earthquakes as planned: which motion, when, how warm."""

    motion: int
    start: datetime
    temperature: float


def trial(case: str, seed: int) -> Trial:
    """The trial of that case and seed: the same each time."""
    rng = np.random.default_rng([seed, *case.encode()])
    stands = building(rng, max(PEAKS))
    plans = _plans(rng)
    hidden = tuple((LAWS[name], LAWS[name].values(stands.layer, rng)) for name in _names(case))
    accelerometers = Noise(level=float(rng.choice([0.01, 0.03, 0.1])))
    if hidden:
        hidden = _strong_enough(stands, hidden, plans, float(np.exp(rng.uniform(*np.log(MISFIT)))))
    laws = _laws(stands.layer, hidden)
    scales = _scales(stands, laws, plans)
    answers = _answers(stands, laws, plans, scales, FINE)
    described = _described(stands, rng)
    events = tuple(_event(plan, *answer, described, accelerometers, rng) for plan, answer in zip(plans, answers, strict=True))
    return Trial(case, seed, hidden, stands, described, accelerometers, events, _misfit(events, stands.layer))


def _names(case: str) -> tuple[str, ...]:
    return () if case == "nothing" else tuple(case.split("+"))


def _plans(rng: np.random.Generator) -> tuple[Plan, ...]:
    days = np.cumsum(rng.uniform(3, 200, len(PEAKS)))
    motions = rng.choice(len(MOTIONS), len(PEAKS), replace=False)
    return tuple(
        Plan(int(chosen), START + timedelta(seconds=round(day * 86400)), float(rng.uniform(5, 30)))
        for chosen, day in zip(motions, days - days[0], strict=True)
    )


def _laws(layer: Layer, hidden: Sequence[Hidden]) -> tuple[Hidden, ...]:
    rng = np.random.default_rng(0)  # the layer's own laws draw nothing
    replaced = any(law.kind == "yielding" for law, _ in hidden)
    usual = ("rubber", "dashpot") if replaced else ("rubber", "dashpot", "yielding")
    return (*((LAWS[name], LAWS[name].values(layer, rng)) for name in usual), *hidden)


def _shaking(plan: Plan, scale: float, rate: float) -> Shaking:
    ground = scale * motion(plan.motion, rate)[None]
    time = (plan.start - START).total_seconds()
    return Shaking(1 / rate, ground, np.zeros(ground.shape[1]), plan.temperature, time)


def _scales(stands: Building, laws: Sequence[Hidden], plans: Sequence[Plan]) -> tuple[float, ...]:
    """m/s², peak ground accelerations that move the layer as far as PEAKS, within 5 %."""
    scales: list[float] = []
    states = None
    for peak, plan in zip(PEAKS, plans, strict=True):
        scale = peak * stands.layer.k / stands.superstructure.total_mass * 2
        for _ in range(8):
            answer = shaken(stands.superstructure, laws, _shaking(plan, scale, COARSE), states)
            reached = np.abs(answer.displacement[0]).max()
            if abs(reached / peak - 1) < 0.05:
                break
            scale *= (peak / reached) ** 0.8
        scales.append(scale)
        states = kept(laws, answer.states, 86400.0)
    return tuple(scales)


def _answers(
    stands: Building, laws: Sequence[Hidden], plans: Sequence[Plan], scales: Sequence[float], rate: float
) -> tuple[tuple[Shaking, Answer], ...]:
    """What happened in all earthquakes, the layer keeping its states from one to the next."""
    answers: list[tuple[Shaking, Answer]] = []
    states, before = None, plans[0].start
    for plan, scale in zip(plans, scales, strict=True):
        if answers:
            states = kept(laws, answers[-1][1].states, (plan.start - before).total_seconds() - DURATION)
        shaking = _shaking(plan, scale, rate)
        answers.append((shaking, shaken(stands.superstructure, laws, shaking, states)))
        before = plan.start
    return tuple(answers)


def _strong_enough(stands: Building, hidden: tuple[Hidden, ...], plans: Sequence[Plan], wanted: float) -> tuple[Hidden, ...]:
    """The laws made stronger or weaker together until their misfit is about the wanted one, or limits are met."""
    for _ in range(3):
        laws = _laws(stands.layer, hidden)
        answers = _answers(stands, laws, plans, _scales(stands, laws, plans), COARSE)[:FITTED]
        series = [[getattr(a, name)[0] for _, a in answers] for name in ("displacement", "velocity", "force")]
        reached = misfit(*series, stands.layer.beta)
        if 0.8 < reached / wanted < 1.25:
            break
        hidden = tuple((law, _scaled(law, values, float(np.clip(wanted / reached, 0.2, 3)))) for law, values in hidden)
    return hidden


def _scaled(law: Law, values: Mapping[str, float], factor: float) -> Mapping[str, float]:
    limits = law.limits or {}
    return {
        name: min(value * factor, limits.get(name, np.inf)) if name in law.strength and name != "F_y" else value
        for name, value in values.items()
    }


def _misfit(events: Sequence[Event], layer: Layer) -> float:
    fitted = events[:FITTED]
    return misfit([e.displacement[0] for e in fitted], [e.velocity[0] for e in fitted], [e.force[0] for e in fitted], layer.beta)


def _described(stands: Building, rng: np.random.Generator) -> BuildingDescription:
    """The building as its engineer would describe it: masses right, stiffnesses and isolation about right."""
    structure, layer = stands.superstructure, stands.layer
    stiffness = structure.storey_stiffness * (1 + 0.04 * rng.standard_normal())
    levels = [Level("ground", "ground"), Level("1F", "base", structure.base_mass)]
    levels += [
        Level(name, "floor", float(m), float(k)) for name, m, k in zip(FLOORS, structure.floor_mass, stiffness, strict=True)
    ]
    off = 1 + 0.03 * rng.standard_normal(4)
    design = IsolationDesign(layer.k * off[0], layer.c * off[1], layer.F_y * off[2], layer.D_y * off[3])
    places = [(0, "ground"), *((i, name) for i, name in enumerate(("1F", *FLOORS), start=1) if name in INSTRUMENTED)]
    channels = [Channel(f"XX.TRIAL.{i:02d}.HNX", name, "acceleration", "x") for i, name in places]
    channels.append(Channel("XX.TRIAL.01.HYX", "1F", "displacement", "x"))
    return BuildingDescription("TRIAL", "a building under trial", tuple(levels), IsolationLayer(0.2, design), tuple(channels))


def _event(
    plan: Plan, shaking: Shaking, answer: Answer, described: BuildingDescription, noisy: Noise, rng: np.random.Generator
) -> Event:
    rate = 1 / shaking.h
    event = Event(
        plan.start,
        Record(plan.start, RATE, (), np.zeros((0, 0))),
        sampled(answer.displacement, rate),
        sampled(answer.velocity, rate),
        sampled(answer.force, rate),
        sampled(answer.acceleration, rate),
        sampled(shaking.ground, rate),
        plan.temperature,
    )
    samples = np.array([_reading(channel, event, noisy, rng) for channel in described.channels])
    return replace(event, record=Record(plan.start, RATE, described.channels, samples))


def _reading(channel: Channel, event: Event, noisy: Noise, rng: np.random.Generator) -> Vector:
    if channel.quantity == "displacement":
        return displacement_reading(event.displacement[0], rng)
    exact = event.ground[0] if channel.level == "ground" else event.acceleration[0, ("1F", *FLOORS).index(channel.level)]
    return exact + noise(noisy, float(np.sqrt(np.mean(exact**2))), exact.size, rng)
