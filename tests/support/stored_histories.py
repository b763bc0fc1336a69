"""Years of earthquakes at a building without waveforms: results are invented, and stored as the worker stores them."""

from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import paper_records
from building_models import BASE, GROUND, LAYER, paper
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker

from core.analysis import AnalysisSettings, DirectionAnalysis, EventAnalysis
from core.building import fixed_base_modes
from core.estimators.result import RestoringForce
from core.identification.modes import Mode
from core.isolation_layer.equivalent import EquivalentSegment
from core.isolation_layer.motion import MeasuredMotion, ResidualDisplacement
from core.paper import BUILDING
from core.sensors.sensor_errors import SensorHealth
from service.analyses.store import Inputs
from service.buildings import store as building_store
from service.buildings.tables import Building
from service.jobs import queue as job_queue
from service.jobs.queue import ANALYSE, Claim
from service.kinds import KINDS
from service.records.tables import Event
from service.settings import Settings

START = datetime(2021, 1, 10, tzinfo=UTC)
APART = timedelta(days=40)
SECONDS = timedelta(seconds=60)
LEASE = timedelta(hours=1)
SETTINGS = Settings()
CYCLES = 8
STIFFNESS = 5e8
"""N/m, of the layer moved by one metre; less by the power of a quarter."""
DAMPING = 2e7
PER_KELVIN = -0.004
EXACT = fixed_base_modes(BUILDING)


def start(number: int) -> datetime:
    """Start of an earthquake, counted from 0."""
    return START + number * APART


def earthquake(
    number: int, loss: float = 0.0, gain: float = 1.0, cycles: int = CYCLES, seed: int = 0, swapped: str = BASE
) -> EventAnalysis:
    """Result of an analysis: the layer softens with amplitude and temperature, and events differ by 1 %.

    Args:
        number: of the earthquake, which says when it is and how strong.
        loss: of stiffness, relative.
        gain: of one sensor.
        cycles: how many of the CYCLES the record holds.
        seed: of all else.
        swapped: id of that sensor's channel.
    """
    rng = np.random.default_rng([seed, number])
    moment = start(number)
    temperature = 15.0 + 10.0 * np.sin(2 * np.pi * number * APART / timedelta(days=365)) + rng.standard_normal()
    peak = float(np.exp(rng.uniform(np.log(0.01), np.log(0.1))))
    scatter, changes = 0.01 * rng.standard_normal(), 0.01 * rng.standard_normal((2, CYCLES))
    factor = (1 - loss) * np.exp(scatter + PER_KELVIN * (temperature - 15.0) + changes)
    amplitude = peak * np.geomspace(1.0, 0.1, CYCLES)
    stiffness, damping = np.array([[STIFFNESS], [DAMPING]]) * amplitude**-0.25 * factor
    segments = tuple(
        EquivalentSegment(2.0 * n, 2.0 * n + 2.0, float(a), float(a) / 0.2, float(k), 0.01 * k, float(c), 0.03 * c)
        for n, (a, k, c) in enumerate(zip(amplitude, stiffness, damping, strict=True))
    )[:cycles]
    four = np.zeros(4)
    modes = tuple(
        Mode(
            EXACT.frequency[n] * (1 + 0.003 * rng.standard_normal()),
            EXACT.damping_ratio[n],
            EXACT.shape[:, n] / EXACT.shape[-1, n],
            0.003 * EXACT.frequency[n],
            0.1 * EXACT.damping_ratio[n],
        )
        for n in range(2)
    )
    force = RestoringForce("smoother", four + peak * STIFFNESS, four, four, four + 1e3, modes)
    residual = ResidualDisplacement(2e-4 * rng.standard_normal(), 1e-4)
    motion = MeasuredMotion(four + peak, four, four + 1e-4, four, (0.0, 50.0), 1e-5, residual)
    sensors = tuple(
        SensorHealth(
            channel,
            1e-4 * float(np.exp(0.1 * rng.standard_normal())),
            (gain if channel == swapped else 1.0) * float(np.exp(2e-3 * rng.standard_normal())),
            1e-3,
        )
        for channel in (GROUND, BASE, LAYER)
    )
    return EventAnalysis(
        start=moment,
        rate=100.0,
        count=4,
        directions={"x": DirectionAnalysis(force, motion, segments)},
        quality=(),
        peaks={},
        pga=10 * peak,
        torsion=None,
        axial_load=None,
        refusal=None,
        temperature=temperature,
        sensors=sensors,
    )


def store_history(count: int, onset: int | None = None, loss: float = 0.08, seed: int = 0) -> tuple[EventAnalysis, ...]:
    """So many earthquakes; from the one at `onset` on the layer is softer."""
    return tuple(
        earthquake(number, loss if onset is not None and number >= onset else 0.0, seed=seed) for number in range(count)
    )


def store_history_in_both(count: int, onset: int, loss: float) -> tuple[EventAnalysis, ...]:
    """The same in a direction y too, with as large a loss and a scatter of its own."""
    x, y = (store_history(count, onset, loss, seed) for seed in (0, 1))
    return tuple(
        replace(one, directions={**one.directions, "y": other.directions["x"]}) for one, other in zip(x, y, strict=True)
    )


def building(session: Session, code: str = "PAPER") -> Building:
    """The paper's."""
    text = paper_records.building_file().replace('"PAPER"', f'"{code}"', 1)
    made = building_store.add(session, text, Path("/"), START)
    session.flush()
    return made


def queue_analysis(session: Session, building_id: int, moment: datetime, now: datetime) -> int:
    """Number of the job that analyses the building's event of that moment, which may be new."""
    of_moment = (Event.building_id == building_id, Event.start == moment)
    event = session.scalars(select(Event).where(*of_moment)).one_or_none()
    if event is None:
        event = Event(
            building_id=building_id,
            start=moment,
            end=moment + SECONDS,
            state="gathering",
            created_at=now,
            updated_at=now,
        )
        session.add(event)
        session.flush()
    return job_queue.enqueue(session, event, {}, now).id


def claim_next(session: Session, now: datetime) -> Claim:
    """The next job that waits."""
    found = job_queue.claim(session, now, LEASE)
    assert found is not None
    return found


def store(session: Session, claim: Claim, found: EventAnalysis, now: datetime) -> None:
    """Write what an analysis found as the worker does."""
    made_from = Inputs((), paper(), AnalysisSettings(), _revision(session, claim), (), "described")
    if job_queue.finish(session, claim, now):
        KINDS[ANALYSE].store(session, claim, made_from, (found,), now)


def store_and_monitor(
    sessions: sessionmaker[Session], building_id: int, found: Sequence[EventAnalysis], now: datetime
) -> None:
    """Store these, one after the other, and look for drift at the end."""
    for one in found:
        with sessions.begin() as session:
            job = queue_analysis(session, building_id, one.start, now)
        while True:
            with sessions.begin() as session:
                claim = claim_next(session, now)
                if claim.job_id == job:
                    store(session, claim, one, now)
                    break
                job_queue.release(session, claim)
    do_waiting_work(sessions, now)


def do_waiting_work(sessions: sessionmaker[Session], now: datetime) -> None:
    """Do whatever other work waits."""
    while True:
        with sessions.begin() as session:
            claim = job_queue.claim(session, now, LEASE)
            if claim is None:
                return
            run_job(session, claim, now)


def run_job(session: Session, claim: Claim, now: datetime) -> None:
    """Do a job from its inputs to its rows."""
    kind = KINDS[claim.kind]
    inputs = kind.inputs(session, claim, SETTINGS)
    results: list[object] = []
    for stage in kind.stages(inputs):
        results.append(stage.function(*stage.arguments(results, lambda *_: None)))
    if job_queue.finish(session, claim, now):
        kind.store(session, claim, inputs, results, now)


def _revision(session: Session, claim: Claim) -> int:
    event = session.get_one(Event, claim.event_id)
    return event.building.revisions[-1].id
