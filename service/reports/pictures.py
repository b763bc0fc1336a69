"""The pictures of an earthquake's report, drawn from stored histories and waveforms; each is SVG, or a reason."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import altair as alt
import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from core.arrays import Vector
from core.description import BuildingDescription
from core.record import Channel
from core.shaking.measures import SPECTRUM_PERIODS
from service.analyses import queries as analysis_queries
from service.analyses.tables import DirectionResult
from service.buildings import store as building_store
from service.buildings.description import BuildingFile
from service.db.blobs import decode, decode_history
from service.documents import still
from service.documents.charts import MM
from service.errors import NotFoundError
from service.records import queries as record_queries
from service.records.tables import Event
from service.reports import charts
from service.reports.charts import GAL, History
from service.reports.earthquake import EarthquakeReport, loops
from service.reports.texts import clipped
from service.reports.year import TrendPoint, YearReport

ROOF, BASE = "roof (gal)", "base slab (gal)"
"""Titles of recorded accelerations."""


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture with its words; where there is none, the reason is in place of it."""

    key: str
    title: str
    caption: str
    svg: str
    """Empty where there is no picture."""
    reason: str = ""


def pictures(session: Session, report: EarthquakeReport) -> tuple[Picture, ...]:
    """The pictures of a report: path in plan, loops, spectra, histories."""
    event = session.get_one(Event, report.event)
    file = building_store.described(session, event.building)
    return (
        _orbit(session, report, file),
        _loops(session, report),
        _spectra(session, report, file),
        _histories(session, report, file.description),
    )


def year_pictures(report: YearReport) -> tuple[Picture, ...]:
    """The trends of a year's report."""
    return tuple(_trend(quantity, dict(series)) for quantity, series in report.trends)


def _trend(quantity: str, series: Mapping[str, Sequence[TrendPoint]]) -> Picture:
    title = f"Change of {quantity} at equal amplitude and temperature"
    if not series:
        return _none(quantity, title, "No earthquake has been compared with others yet.")
    caption = "Bars: 95 % interval. Hollow: earthquakes of the reference period."
    return Picture(quantity, title, caption, svg(charts.trend(series, f"change of {quantity} (%)")))


def svg(picture: alt.TopLevelMixin) -> str:
    """A picture as SVG."""
    return still.svg(picture.to_dict(validate=False))


def _orbit(session: Session, report: EarthquakeReport, file: BuildingFile) -> Picture:
    layer = file.description.isolation
    given = (("moat {:.0f} mm", layer.moat_clearance), ("design {:.0f} mm", layer.design_displacement))
    circles = [(label.format(radius * MM), radius) for label, radius in given if radius is not None]
    caption = "" if layer.moat_clearance is not None else "The building file gives no moat_clearance."
    try:
        motion = analysis_queries.layer_motion(session, report.event, report.analysis)
    except NotFoundError:
        motion = None
    if motion is None or motion.displacement_x is None or motion.displacement_y is None:
        return _none("orbit", "Path in plan", "The displacement is not known in both directions.")
    x, y = decode_history(motion.displacement_x), decode_history(motion.displacement_y)
    return Picture("orbit", "Path of the isolators in plan, within the moat", caption, svg(charts.orbit(x, y, circles)))


def _loops(session: Session, report: EarthquakeReport) -> Picture:
    of_analysis = (DirectionResult.analysis_id == report.analysis, DirectionResult.direction == report.direction)
    mine = session.scalars(loops().where(*of_analysis)).one_or_none()
    if mine is None:
        return _none("loops", "Hysteresis loop", "No displacement of the isolators is known.")
    earlier = session.scalars(loops().where(DirectionResult.id.in_(report.earlier))).all()
    drawn = svg(charts.loops(_loop(mine), [_loop(one) for one in earlier]))
    caption = "No earlier loop is stored."
    if earlier:
        caption = f"Black: this earthquake. Grey: the {len(earlier)} largest before it."
    return Picture("loops", f"Hysteresis loop, direction {report.direction}", caption, drawn)


def _loop(result: DirectionResult) -> tuple[Vector, Vector]:
    """Displacement (m) and force (N)."""
    assert result.displacement is not None
    return decode_history(result.displacement), decode_history(result.force)


def _spectra(session: Session, report: EarthquakeReport, file: BuildingFile) -> Picture:
    shaking = None if report.analysis is None else analysis_queries.shaking_result(session, report.analysis)
    if shaking is None or not shaking.spectrum:
        return _none("spectra", "Response spectrum", "No horizontal acceleration was recorded.")
    measured = {name: np.array(values) for name, values in sorted(shaking.spectrum.items()) if values}
    where = "ground" if shaking.is_below_isolators else clipped(shaking.level, 24)
    design = file.design_spectrum
    known = (
        "The building file gives no design spectrum." if design is None else f"Thick grey: {clipped(design.source)}."
    )
    lines = ", ".join(f"{name} dashed" if name == "y" else f"{name} solid" for name in measured)
    drawn = charts.spectra(
        SPECTRUM_PERIODS, measured, None if design is None else (design.periods, design.acceleration)
    )
    return Picture("spectra", f"Response spectrum, {where}, 5 % damping", f"{lines}. {known}", svg(drawn))


def _histories(session: Session, report: EarthquakeReport, description: BuildingDescription) -> Picture:
    shown = list(_series(session, report, description))
    if not shown:
        return _none("histories", "Histories", "Neither accelerations nor the displacement are known.")
    title = f"Accelerations as recorded, and displacement of the isolators, direction {report.direction or 'x'}"
    return Picture("histories", title, "", svg(charts.histories(shown)))


def _series(session: Session, report: EarthquakeReport, description: BuildingDescription) -> Iterator[History]:
    """Roof, base slab and isolation layer, as far as they are known."""
    for name, level in ((ROOF, description.floors[-1].name), (BASE, description.base.name)):
        for channel in _accelerometers(description, level, report.direction or "x"):
            if (series := _recorded(session, report.event, channel.id)) is not None:
                yield History(name, series[0], series[1] * GAL)
                break
    if report.direction is None:
        return
    query = select(DirectionResult.rate, DirectionResult.displacement).where(
        DirectionResult.analysis_id == report.analysis,
        DirectionResult.direction == report.direction,
        DirectionResult.displacement.is_not(None),
    )
    if (row := session.execute(query).one_or_none()) is not None:
        values = decode_history(row.displacement)
        yield History("isolators (mm)", np.arange(values.size) / row.rate, values * MM)


def _accelerometers(description: BuildingDescription, level: str, direction: str) -> Sequence[Channel]:
    place = (level, "acceleration", direction)
    return [one for one in description.channels if (one.level, one.quantity, one.direction) == place]


def _recorded(session: Session, event_id: int, channel: str) -> tuple[Vector, Vector] | None:
    """Time (s after the event's start) and acceleration (m/s², about its mean) of a channel; None if not recorded."""
    try:
        event, pieces = record_queries.channel(session, event_id, channel)
    except NotFoundError:
        return None
    times, values = [], []
    for piece in pieces:
        samples = decode(piece.samples).astype(float) * piece.gain
        times.append((piece.start - event.start).total_seconds() + np.arange(samples.size) / piece.rate)
        values.append(samples)
    time, joined = np.concatenate(times), np.concatenate(values)
    is_known = np.isfinite(joined)
    if not is_known.any():
        return None
    return time[is_known], joined[is_known] - joined[is_known].mean()


def _none(key: str, title: str, reason: str) -> Picture:
    return Picture(key, title, "", "", reason)
