"""Inputs of an analysis read from the database, and its results written there."""

import hashlib
import logging
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from math import isfinite
from typing import Any

from sqlalchemy import select, update
from sqlalchemy.orm import Session, undefer

from core.analysis import AnalysisSettings, DirectionAnalysis, EventAnalysis, analyse
from core.arrays import Vector
from core.description import BuildingDescription
from core.identification.modes import Mode
from core.isolation_layer.motion import MeasuredMotion
from core.record import Segment
from service import logs
from service.analyses.tables import (
    Analysis,
    CycleResult,
    DirectionResult,
    LayerResult,
    ModeResult,
    SensorResult,
    ShakingResult,
)
from service.buildings import store as building_store
from service.buildings.tables import Revision
from service.db.blobs import decode, encode_deviation, encode_history
from service.jobs.kept import Kept
from service.jobs.queue import Claim
from service.records.tables import Event, EventRecording, Recording, Waveform
from service.settings import Settings
from service.version import VERSION

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, eq=False)
class Inputs:
    """The inputs of an analysis, named in its result's provenance."""

    segments: tuple[Segment, ...]
    description: BuildingDescription
    settings: AnalysisSettings
    revision_id: int
    sha256: tuple[str, ...]
    """Digests of the event's recordings."""

    description_sha256: str
    """Digest of the building's description as stored."""

    @property
    def key(self) -> str:
        """Digest of all that the analysis depends on."""
        return analysis_key(self.segments, self.description_sha256, self.settings)


def analysis_key(segments: Sequence[Segment], description_sha256: str, settings: AnalysisSettings) -> str:
    """Digest of all that an analysis depends on, the samples too: a new gain changes them, and no recording."""
    digest = hashlib.sha256(repr((description_sha256, settings)).encode())
    for one in segments:
        digest.update(repr((one.channel, one.start, one.rate)).encode())
        digest.update(hashlib.sha256(one.samples.tobytes()).digest())
    return digest.hexdigest()


def kept_analysis(
    segments: Sequence[Segment],
    description: BuildingDescription,
    description_sha256: str,
    settings: AnalysisSettings,
    kept: Kept,
) -> EventAnalysis:
    """The analysis that is kept, or a new one, which is kept from then on; an empty digest keeps none.

    Raises:
        CoreError: as `analyse`.
    """
    if not description_sha256:
        return analyse(segments, description, settings)
    key = analysis_key(segments, description_sha256, settings)
    found: EventAnalysis | None = kept.find(key)
    if found is None:
        found = analyse(segments, description, settings)
        kept.add(key, found)
    return found


def inputs(session: Session, claim: Claim, settings: Settings) -> Inputs:
    """The inputs of a claimed job's analysis, as stored now."""
    event = session.get_one(Event, claim.event_id)
    revision = session.scalars(
        select(Revision).where(Revision.building_id == event.building_id).order_by(Revision.number.desc()).limit(1)
    ).one()
    return event_inputs(session, event, revision, analysis_settings(settings, claim.arguments))


def event_inputs(session: Session, event: Event, revision: Revision, settings: AnalysisSettings) -> Inputs:
    """The inputs of an analysis of an event with these settings."""
    waveforms = session.scalars(
        select(Waveform)
        .where(Waveform.event_id == event.id)
        .order_by(Waveform.channel, Waveform.start)
        .options(undefer(Waveform.samples))
    )
    hashes = session.scalars(
        select(Recording.sha256)
        .join(EventRecording, EventRecording.recording_id == Recording.id)
        .where(EventRecording.event_id == event.id)
        .order_by(Recording.sha256)
    )
    return Inputs(
        segments=tuple(_segment(waveform) for waveform in waveforms),
        description=building_store.parsed(revision).description,
        settings=settings,
        revision_id=revision.id,
        sha256=tuple(sha256 for sha256 in hashes if sha256 is not None),
        description_sha256=hashlib.sha256((revision.parsed or revision.toml).encode()).hexdigest(),
    )


def settings_of(analysis: Analysis) -> AnalysisSettings:
    """The settings that an analysis was made with."""
    return AnalysisSettings(**_without_lists(analysis.settings))


def analysis_settings(settings: Settings, arguments: Mapping[str, Any]) -> AnalysisSettings:
    """The service's analysis settings, overridden by the arguments of a job."""
    given = settings.analysis
    own = AnalysisSettings(estimator=given.estimator, rate=given.rate, band=given.band, integral=given.integral)
    return replace(own, **_without_lists(arguments))


def _without_lists(values: Mapping[str, Any]) -> dict[str, Any]:
    """Tuples in place of lists, which JSON has instead."""
    return {name: tuple(value) if isinstance(value, list) else value for name, value in values.items()}


def store(session: Session, claim: Claim, inputs: Inputs, result: EventAnalysis, now: datetime) -> Analysis:
    """Write a result beside the event's earlier ones; it is the current one unless a later job's is there."""
    event = session.get_one(Event, claim.event_id, with_for_update={"key_share": True})  # or two would be current
    of_event = Analysis.event_id == event.id
    latest = session.scalar(select(Analysis.id).where(of_event, Analysis.job_id > claim.job_id).limit(1)) is None
    if latest:
        session.execute(update(Analysis).where(of_event).values(current=False))
        event.state = "analysed" if result.refusal is None else "refused"
        event.reason, event.updated_at = result.refusal, now
    analysis = row(result, inputs.description, inputs.settings)
    analysis.event_id, analysis.job_id, analysis.revision_id = event.id, claim.job_id, inputs.revision_id
    analysis.current, analysis.created_at, analysis.inputs = latest, now, list(inputs.sha256)
    session.add(analysis)
    _log_unusable(session, event, result)
    when = f"{event.start:%Y-%m-%d %H:%M:%S} UTC"
    with logs.about(event=event.id, building=event.building.code):
        log.info("event %d of %s, %s: %s", event.id, event.building.code, when, _outcome(result))
    return analysis


def row(result: EventAnalysis, description: BuildingDescription, settings: AnalysisSettings) -> Analysis:
    """The row of a result, as yet of no event and no job."""
    return Analysis(
        version=VERSION,
        settings=asdict(settings),
        estimator=settings.estimator if result.directions else None,
        quality=[asdict(finding) for finding in result.quality],
        refusal=result.refusal,
        peaks=dict(result.peaks),
        pga=result.pga,
        temperature=result.temperature,
        directions=[
            _direction_result(name, direction, result, description) for name, direction in result.directions.items()
        ],
        layer=_layer_result(result),
        sensors=[SensorResult(**asdict(sensor)) for sensor in result.sensors],
        shaking=_shaking_result(result),
    )


def _outcome(result: EventAnalysis) -> str:
    """The outcome of an analysis for a line of the log."""
    if result.refusal is not None:
        return f"could not be analysed: {result.refusal}"
    peaks = {name: one.motion.peak[0] for name, one in result.directions.items() if one.motion is not None}
    moved = ", ".join(f"{1e3 * peak:.3g} mm in direction {name}" for name, peak in peaks.items())
    return f"analysed; the isolators moved {moved}" if moved else "analysed; no displacement of the isolators is known"


def _log_unusable(session: Session, event: Event, result: EventAnalysis) -> None:
    """One line where records of the event cannot be used: its files, and what is wrong with them."""
    fatal = [one for one in result.quality if one.severity == "fatal"]
    if not fatal:
        return
    names = session.scalars(
        select(Recording.name)
        .join(EventRecording, EventRecording.recording_id == Recording.id)
        .where(EventRecording.event_id == event.id)
        .order_by(Recording.id)
    )
    said = "; ".join(" ".join(filter(None, (one.channel, one.message))) for one in fatal)
    with logs.about(event=event.id, building=event.building.code):
        log.warning("event %d of %s (%s): %s", event.id, event.building.code, ", ".join(names), said)


def _segment(waveform: Waveform) -> Segment:
    samples = decode(waveform.samples) * waveform.gain
    return Segment(waveform.channel, waveform.start, waveform.rate, samples)


def _direction_result(
    name: str, direction: DirectionAnalysis, result: EventAnalysis, description: BuildingDescription
) -> DirectionResult:
    force = direction.restoring_force
    peak, peak_std = force.peak
    return DirectionResult(
        direction=name,
        start=result.start,
        rate=result.rate,
        count=force.force.size,
        peak_force=peak,
        force_std=peak_std,
        assessment=None if force.assessment is None else asdict(force.assessment),
        **({} if direction.motion is None else _motion(direction.motion)),
        force=encode_history(force.force, force.std),
        force_rigid=encode_history(force.rigid, force.std),
        force_modal=encode_history(force.modal, force.std),
        force_std_history=encode_deviation(force.std),
        modes=[_mode_result(number, mode, description) for number, mode in enumerate(force.modes, start=1)],
        cycles=[CycleResult(**asdict(segment)) for segment in direction.equivalent],
    )


def _motion(motion: MeasuredMotion) -> dict[str, Any]:
    """Columns of a direction's result."""
    peak, peak_std = motion.peak
    residual = motion.residual
    return {
        "peak_displacement": peak,
        "peak_displacement_std": peak_std,
        "lowest_frequency": motion.band[0],
        "highest_frequency": motion.band[1],
        "residual_displacement": None if residual is None else residual.value,
        "residual_displacement_std": None if residual is None else residual.std,
        "displacement": encode_history(motion.displacement, motion.displacement_std),
        "velocity": encode_history(motion.velocity, motion.velocity_std),
        "displacement_std_history": encode_deviation(motion.displacement_std),
        "velocity_std_history": encode_deviation(motion.velocity_std),
    }


def _layer_result(result: EventAnalysis) -> LayerResult | None:
    """None where nothing is known of the layer beside its directions."""
    torsion, load = result.torsion, result.axial_load
    if result.orbit is None and torsion is None and load is None:
        return None
    peak, std = (None, None) if torsion is None else torsion.peak
    return LayerResult(
        start=result.start,
        rate=result.rate,
        count=result.count,
        peak_resultant=result.peak_resultant,
        peak_torsion=peak,
        peak_torsion_std=std,
        torsion_lowest_frequency=torsion and torsion.band[0],
        axial_load_level=load and load.level,
        lowest_axial_load=load and float(load.ratio.min()),
        highest_axial_load=load and float(load.ratio.max()),
        torsion=torsion and encode_history(torsion.displacement, torsion.displacement_std),
        torsion_std_history=torsion and encode_deviation(torsion.displacement_std),
        axial_load=load and encode_history(load.ratio),
    )


def _shaking_result(result: EventAnalysis) -> ShakingResult | None:
    """None where nothing measures the shaking."""
    shaking = result.shaking
    if shaking is None:
        return None
    floors = [one for motion in result.floors for one in motion.accelerations]
    storeys = [one for motion in result.floors for one in motion.storeys]
    return ShakingResult(
        level=shaking.level,
        is_below_isolators=shaking.is_below_isolators,
        components=list(shaking.components),
        pga=shaking.pga,
        pgv=shaking.pgv,
        intensity=shaking.intensity if isfinite(shaking.intensity) else None,
        long_period_velocity=shaking.long_period_velocity,
        arias=shaking.arias,
        duration=shaking.duration,
        spectrum={direction: values.tolist() for direction, values in shaking.spectrum.items()},
        floors=[asdict(one) for one in floors],
        storeys=[asdict(one) for one in storeys],
        peak_floor_acceleration=max((one.peak for one in floors), default=None),
        peak_storey_displacement=max((one.peak for one in storeys), default=None),
        travel=result.travel,
    )


def _mode_result(number: int, mode: Mode, description: BuildingDescription) -> ModeResult:
    return ModeResult(
        number=number,
        frequency=mode.frequency,
        frequency_std=mode.frequency_std,
        damping_ratio=mode.damping_ratio,
        damping_ratio_std=mode.damping_ratio_std,
        shape=_by_level(mode.shape, description),
        shape_std=None if mode.shape_std is None else _by_level(mode.shape_std, description),
        misfit=mode.misfit,
    )


def _by_level(values: Vector, description: BuildingDescription) -> dict[str, float]:
    return {level.name: float(value) for level, value in zip(description.floors, values, strict=True)}
