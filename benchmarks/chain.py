"""The whole chain for one event, as the worker calls it: time of every estimator and of the parts."""

from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from functools import partial
from types import MappingProxyType

import numpy as np

from benchmarks.table import Table
from benchmarks.trial import ROUNDS, Limits, Refusal, Trial, Way, trials
from core.analysis import AnalysisSettings, EventAnalysis, analyse
from core.arrays import Vector
from core.comparison.misfit import fitting_rate
from core.description import BuildingDescription, IsolationLayer, Level
from core.estimators import ESTIMATORS
from core.model.simulation import Response, simulate
from core.paper import BUILDING, FOURTH_STOREY, ISOLATOR, RATE, ground_motion
from core.record import Channel, Direction, Segment
from service.akt013 import recorded

NOISE = 0.01
"""Noise over each channel's root mean square."""
START = datetime(2026, 1, 1, tzinfo=UTC)
FLOORS = tuple(f"{number}F" for number in range(2, 9))
ONE, TWO, EVERY = "5 channels, one direction", "10 channels, two directions", "20 channels, two directions"
GOALS: Mapping[str, float] = MappingProxyType({ONE: 0.3, TWO: 0.6})
"""s, by the event's name; more channels have none."""
BEFORE: Mapping[str, float] = MappingProxyType(
    {
        f"cms: {ONE}": 0.432,
        f"cms: {TWO}": 0.784,
        f"cms: {EVERY}": 1.475,
        f"smoother: {ONE}": 1.008,
        f"smoother: {TWO}": 2.961,
        f"smoother: {EVERY}": 7.767,
    }
)
"""s, as measured when the goals were set."""
FLEET, CORES, WITHIN = 10_000, 8, 30.0
"""Buildings with one event each, on so many cores, in so many minutes."""


def tables() -> Iterator[Table]:
    """One: the paper's four accelerometers and its transducer; the same in two directions; every floor in two."""
    ground = ground_motion(*recorded())
    response = simulate(BUILDING, ISOLATOR, ground, RATE)
    paper, every = (FOURTH_STOREY, 6), tuple(range(7))
    yield table(
        {
            ONE: event(ground, response, paper, ("x",)),
            TWO: event(ground, response, paper, ("x", "y")),
            EVERY: event(ground, response, every, ("x", "y")),
        },
        response.force,
        Limits(),
    )


Event = tuple[list[Segment], BuildingDescription]


def event(ground: Vector, response: Response, measured: tuple[int, ...], directions: tuple[Direction, ...]) -> Event:
    """Records of the sensors, the same motion in each direction with noise of its own; and the building."""
    rng = np.random.default_rng(1)
    sensed: dict[Channel, Vector] = {}
    for direction in directions:
        seen = [("ground", "acceleration", ground), ("1F", "acceleration", response.base_acceleration)]
        seen += [(FLOORS[floor], "acceleration", response.floor_acceleration[floor]) for floor in measured]
        seen += [("1F", "displacement", response.isolator_displacement)]
        for level, quantity, exact in seen:
            channel = Channel(f"{level} {quantity} {direction}", level, quantity, direction)  # type: ignore[arg-type]
            noise = NOISE * float(np.sqrt(np.mean(exact**2)))
            sensed[channel] = exact + noise * rng.standard_normal(exact.size)
    levels = [Level("ground", "ground"), Level("1F", "base", BUILDING.base_mass)]
    levels += [Level(name, "floor", float(mass)) for name, mass in zip(FLOORS, BUILDING.floor_mass, strict=True)]
    description = BuildingDescription("PAPER", "the paper's", tuple(levels), IsolationLayer(0.2), tuple(sensed))
    return [Segment(channel.id, START, RATE, samples) for channel, samples in sensed.items()], description


def table(events: Mapping[str, Event], truth: Vector, limits: Limits, rounds: int = ROUNDS) -> Table:
    """Every estimator on every event."""
    ways = [
        Way(f"{estimator}: {name}", "core.analysis", partial(analyse, *event, AnalysisSettings(estimator=estimator)))
        for estimator in ESTIMATORS
        for name, event in events.items()
    ]
    return Table(
        title="One event of 180 s at 100 Hz",
        about=(
            "The complete analysis of one event (core.analysis.analyse): screening, identification, restoring force, "
            "motion of the layer, stiffness and damping of every cycle. AKT013 scaled to 70 gal, 1 % noise. Values "
            f"that miss their goal are **bold**. The goal for a fleet is {FLEET:,} buildings with one event each "
            f"within {WITHIN:g} min on {CORES} cores."
        ),
        columns=(
            "estimator: record",
            "ms",
            "goal, ms",
            "when the goals were set, ms",
            f"{FLEET:,} on {CORES} cores, min",
            "MB",
            "fit of F, %",
            "cycles",
        ),
        rows=tuple(row(name, trial, truth) for name, trial in trials(ways, limits, rounds).items()),
        remark=(
            f"The minutes are the milliseconds times {FLEET:,} / {CORES}, without the database. The times of the "
            'column "when the goals were set" were measured on another day. The estimate alone is timed in '
            "[Accuracy](accuracy.md#time), at another load of the machine: do not compare it with these times."
        ),
    )


def row(name: str, trial: Trial[EventAnalysis] | Refusal, truth: Vector) -> tuple[str, ...]:
    """Time and memory of one analysis, and its result in direction x."""
    if isinstance(trial, Refusal):
        return (name, trial.reason, "", "", "", "", "", "")
    found = trial.result.directions["x"]
    minutes = trial.seconds * FLEET / CORES / 60
    fit = fitting_rate(truth, found.restoring_force.force)
    cycles = sum(len(direction.equivalent) for direction in trial.result.directions.values())
    goal = GOALS.get(name.partition(": ")[2])
    taken = f"{1e3 * trial.seconds:.0f}"
    shown = taken if goal is None or trial.seconds <= goal else f"**{taken}**"
    before = f"{1e3 * BEFORE[name]:.0f}" if name in BEFORE else ""
    aim = "" if goal is None else f"{1e3 * goal:.0f}"
    return (name, shown, aim, before, f"{minutes:.1f}", f"{trial.megabytes:.0f}", f"{fit:.1f}", f"{cycles}")
