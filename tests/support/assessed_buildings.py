"""A building with every sensor and every limit, and earthquakes for which every check can be decided."""

from datetime import datetime, timedelta
from itertools import count
from pathlib import Path

import numpy as np
from alert_candidates import DAY, START
from alert_fixtures import direction
from sqlalchemy.orm import Session

from core.shaking.measures import SPECTRUM_PERIODS
from service.analyses.tables import Analysis, LayerResult, ShakingResult
from service.buildings import store as building_store
from service.buildings.tables import Building
from service.db.blobs import encode
from service.drift.tables import DriftValue, MonitoredSeries
from service.jobs import queue as job_queue
from service.records.tables import Event

NUMBERS = count(1)
LIMITS = "design_displacement = 0.4\nmoat_clearance = 0.5\n"
STRONG = 0.295
"""m, a shear strain of 147.5 %."""


def building_file(code: str, limits: str = LIMITS) -> str:
    """Accelerometers on the slab and transducers of the layer, in x and y."""
    lines = [
        f'code = "{code}"\nname = "a tower"\ntimezone = "Asia/Tokyo"',
        '[[level]]\nname = "pit"\nrole = "ground"',
        '[[level]]\nname = "slab"\nrole = "base"\nmass = 8.0e6',
        '[[level]]\nname = "roof"\nmass = 2.0e6\nheight = 4.0',
        f"[isolation]\nrubber_height = 0.2\n{limits}",
    ]
    lines += [
        f'[[channel]]\nid = "XX.{code}.01.H{instrument}{axis.upper()}"\nlevel = "slab"\ndirection = "{axis}"\n'
        f'quantity = "{quantity}"'
        for axis in "xy"
        for instrument, quantity in (("N", "acceleration"), ("Y", "displacement"))
    ]
    return "\n".join(lines) + "\n"


def building(session: Session, limits: str = LIMITS) -> Building:
    """A new one, whose reference period is complete."""
    made = building_store.add(session, building_file(f"J{next(NUMBERS)}", limits), Path("/"), START)
    session.flush()
    first = earthquake(session, made, START, 0.1)
    watch = job_queue.enqueue_monitoring(session, made.id, None, START)
    watch.state = "done"
    for axis in "xy":
        series = MonitoredSeries(
            building_id=made.id,
            job_id=watch.id,
            created_at=START,
            version="test",
            quantity="stiffness",
            subject=axis,
            wanted=0,
        )
        series.values.append(drift_value(first, is_reference=True))
        session.add(series)
    session.flush()
    return made


def earthquake(
    session: Session, of: Building, start: datetime, displacement: float = 0.02, quality: tuple[str, ...] = ()
) -> Event:
    """One that was analysed with every result, but not compared with others yet; its records have these problems."""
    end = start + timedelta(minutes=5)
    event = Event(building_id=of.id, start=start, end=end, state="gathering", created_at=end, updated_at=end)
    session.add(event)
    session.flush()
    job = job_queue.enqueue(session, event, {"number": next(NUMBERS)}, end)
    job.state, event.state = "done", "analysed"
    results = [direction(event, displacement if axis == "x" else displacement / 10) for axis in "xy"]
    for axis, one in zip("xy", results, strict=True):
        one.direction, one.residual_displacement, one.residual_displacement_std = axis, 0.0005, 2e-4
        one.displacement = encode(np.linspace(0, displacement, 5))
    session.add(
        Analysis(
            event_id=event.id,
            job_id=job.id,
            revision_id=building_store.current(session, of).id,
            current=True,
            created_at=end,
            version="test",
            settings={},
            inputs=[],
            quality=[
                {"kind": "spike", "severity": "warning", "message": one, "channel": None, "value": None}
                for one in quality
            ],
            refusal=None,
            peaks={},
            pga=0.5,
            directions=results,
            layer=LayerResult(start=start, rate=100.0, count=5, peak_resultant=displacement),
            shaking=shaking(),
        )
    )
    session.flush()
    return event


def shaking(
    intensity: float = 3.0, drift: float = 0.002, floor: float = 0.4, long_period: float = 0.08
) -> ShakingResult:
    """Moderate shaking, a storey's displacement in m, a floor's acceleration in m/s², a long-period velocity in m/s."""
    return ShakingResult(
        level="pit",
        is_below_isolators=True,
        components=["x", "y", "z"],
        pga=0.5,
        pgv=0.05,
        intensity=intensity,
        long_period_velocity=long_period,
        arias=0.01,
        duration=20.0,
        spectrum={axis: [0.9 if period < 0.3 else 0.3 for period in SPECTRUM_PERIODS] for axis in "xy"},
        floors=[{"level": "roof", "direction": "x", "peak": floor, "std": 0.001, "is_measured": True}],
        storeys=[{"level": "roof", "direction": "x", "peak": drift, "std": 0.05 * drift}],
        peak_floor_acceleration=floor,
        peak_storey_displacement=drift,
        travel=1.0,
    )


def add_comparison(session: Session, event: Event, change: float = 0.0, std: float = 0.01) -> None:
    """The earthquake was compared with the reference, in both directions."""
    for series in session.query(MonitoredSeries).filter_by(building_id=event.building_id):
        series.values.append(drift_value(event, change, std))
    session.flush()


def drift_value(event: Event, change: float = 0.0, std: float = 0.01, is_reference: bool = False) -> DriftValue:
    """An earthquake's change of stiffness."""
    return DriftValue(
        event_id=event.id,
        value=change,
        std=std,
        count=5,
        is_reference=is_reference,
        is_beyond=False,
        is_excluded=False,
        causes=[],
    )


def day(number: int) -> datetime:
    """So many days after the start."""
    return START + number * DAY
