"""Each fault of a sensor is undone in the samples; what cannot be undone is left out or stays."""

import numpy as np
import pytest
from building_models import BASE, FOURTH, LAYER, ROOF, paper, segments
from consistent_records import consistent_record
from consistent_sensors import COUNT, RATE
from paper_records import START

from core.analysis import EventAnalysis
from core.arrays import Vector
from core.diagnosis.corrections import Correction, corrected, correction
from core.diagnosis.sensor_faults import BuildingFault, Cause
from core.record import Finding
from core.sensors.preparation import joined, on_one_time_base

TIME = np.arange(COUNT) / RATE


def fault(kind: str, channel: str, value: float = 0.0, std: float | None = 0.01, late: float = 0.0) -> BuildingFault:
    return BuildingFault(Cause.SENSOR, kind, channel, value, std, "", late)


def analysis(*quality: Finding) -> EventAnalysis:
    return EventAnalysis(START, RATE, COUNT, {}, quality, {}, None, None, None, None)


def wave(time: Vector) -> Vector:
    """(n,) m/s², up to 12 Hz."""
    return np.asarray(sum(np.sin(2 * np.pi * f * time + f) for f in (0.4, 1.3, 5.0, 12.0)))


def aligned(samples: Vector, how: Correction) -> Vector:
    """(n,) the roof's samples after a correction, on the time base of the base slab's."""
    made = corrected(segments({BASE: wave(TIME), ROOF: samples}), [how])
    traces = {one.channel: joined([one])[0] for one in made}
    channels = [one for one in paper().channels if one.id in traces]
    record = on_one_time_base(traces, channels, RATE)
    base, roof = record.samples
    assert base.size > COUNT - 10
    return np.asarray(roof - base)


@pytest.mark.parametrize(
    ("recorded", "found"),
    [
        (1.2 * wave(TIME), fault("gain", ROOF, 0.2)),
        (-wave(TIME), fault("polarity", ROOF, -1.0, None)),
        (wave(TIME - 0.0234), fault("delay", ROOF, 0.0234)),
        (wave(TIME - 0.02 - 5e-4 * (TIME - TIME[-1] / 2)), fault("clock", ROOF, 5e-4, late=0.02)),
    ],
)
def test_gain_polarity_delay_and_clock_are_undone(recorded: Vector, found: BuildingFault) -> None:
    """To 2 %, away from the ends: splines between samples, and a clock's delay to first order."""
    how = correction(found, [analysis()], paper())
    assert how is not None
    left = aligned(recorded, how)[200:-200]
    assert np.abs(left).max() < 0.02 * np.abs(wave(TIME)).max()


def test_exchanged_channels_are_exchanged_again() -> None:
    quality = (Finding("swapped", "warning", "", ROOF, 1.0), Finding("swapped", "warning", "", FOURTH, 1.0))
    wanted = [correction(fault("swap", name, 1.0, None), [analysis(*quality)], paper()) for name in (ROOF, FOURTH)]
    assert None not in wanted
    made = corrected(segments({ROOF: 0 * TIME, FOURTH: TIME}), [one for one in wanted if one is not None])
    assert {one.channel: float(one.samples[-1]) for one in made} == {FOURTH: 0.0, ROOF: TIME[-1]}


def test_a_level_out_of_order_has_no_partner_to_exchange_with() -> None:
    quality = (Finding("swapped", "warning", "", ROOF, -0.3),)
    assert correction(fault("swap", ROOF, -0.3, None), [analysis(*quality)], paper()) is None


def test_a_transducers_drift_is_removed() -> None:
    record = consistent_record({}, 0.01, [7, 1])
    row = next(at for at, channel in enumerate(record.channels) if channel.id == LAYER)
    true = record.samples[row]
    how = correction(fault("drift", LAYER, 0.01), [analysis()], paper())
    assert how is not None
    (made,) = corrected(segments({LAYER: true + 0.02 * TIME / TIME[-1]}), [how])
    assert np.std(made.samples - true) < 0.1 * np.std(0.02 * TIME / TIME[-1])


def test_a_clock_that_jumps_is_left_out_unless_nothing_can_be_estimated_without_it() -> None:
    how = correction(fault("clock_jump", ROOF, 0.1, None), [analysis()], paper())
    assert how == Correction(ROOF, ROOF, is_left_out=True)
    assert corrected(segments({ROOF: TIME}), [how]) == ()
    assert correction(fault("clock_jump", BASE, 0.1, None), [analysis()], paper()) is None


def test_what_the_analysis_left_out_needs_no_correction() -> None:
    for kind in ("clipping", "spikes", "dropped", "dead", "rotation"):
        assert correction(fault(kind, ROOF, 1.0, None), [analysis()], paper()) is None


def test_a_channel_in_another_unit_is_left_out_throughout() -> None:
    how = correction(fault("gain", ROOF, 9.0, None), [analysis()], paper())
    assert how == Correction(ROOF, ROOF, is_left_out=True)
