"""A floor's quasi-static deflection, and a layer that barely moves, are not sensor faults."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torsion_building
from biaxial_records import record_of, turned
from building_models import BASE, FOURTH, GROUND, LAYER, ROOF, START, paper, segments

from core.analysis import AnalysisSettings, analyse
from core.arrays import Vector
from core.description import BuildingDescription, Level
from core.record import Record
from core.sensors.clock import one_body_below
from core.sensors.reconciliation import disagreements, reconciled
from service.buildings.description import read

RATE, COUNT = 100.0, 6000
FREQUENCY = np.fft.rfftfreq(COUNT, 1 / RATE)
ω = 2 * np.pi * FREQUENCY


def motion(rng: np.random.Generator, centre: float) -> Vector:
    """(COUNT,) m/s², broad about a frequency in Hz, of standard deviation 1, fading at both ends."""
    spectrum = np.fft.rfft(rng.standard_normal(COUNT)) * np.exp(-((np.log(np.maximum(FREQUENCY, 0.01) / centre)) ** 2))
    history = np.fft.irfft(spectrum, COUNT) * np.hanning(COUNT)
    return np.asarray(history / history.std())


def roof(base: Vector, first: float) -> Vector:
    """Roof acceleration of a superstructure of one mode, 2 % damped."""
    ω_1 = 2 * np.pi * first
    transfer = 1 + 1.27 * ω**2 / (ω_1**2 - ω**2 + 2j * 0.02 * ω * ω_1)
    return np.fft.irfft(np.fft.rfft(base) * transfer, COUNT)


def displacement(relative: Vector) -> Vector:
    """(COUNT,) m, above 0.1 Hz."""
    factor = np.where(FREQUENCY > 0.1, -1 / np.maximum(ω, 0.1) ** 2, 0)
    return np.fft.irfft(np.fft.rfft(relative) * factor, COUNT)


def reported(samples: dict[str, Vector]) -> list[tuple[str, str | None]]:
    channels = tuple(channel for channel in paper().channels if channel.id in samples)
    record = Record(START, RATE, channels, np.array([samples[channel.id] for channel in channels]))
    return [(finding.kind, finding.channel) for finding in disagreements(record, paper())]


@pytest.mark.parametrize("first", [1.05, 1.3, 2.0])
@pytest.mark.parametrize("gain", [1.0, 0.1, 10.0])
def test_deflection_below_the_first_frequency_is_no_gain(first: float, gain: float) -> None:
    """At 0.65 Hz and a first frequency of 1.05 Hz the roof moves 1.8 times as much as the base slab."""
    rng = np.random.default_rng(1)
    base = motion(rng, 0.65)
    samples = {BASE: base, ROOF: gain * roof(base, first)}
    assert reported(samples) == ([] if gain == 1 else [("unit", ROOF)])


@pytest.mark.parametrize("moved", [0.02, 1.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_layer_that_moves_less_than_its_sides_noise_is_not_judged(moved: float, sign: float) -> None:
    """At 2 % of its sides' motion what they say of the layer is their noise of 3 %."""
    rng = np.random.default_rng(2)
    ground, relative = motion(rng, 0.5), moved * motion(rng, 0.5)
    noise = 0.03 * rng.standard_normal((2, COUNT))
    layer = sign * displacement(relative)
    samples = {GROUND: ground + noise[0], BASE: ground + relative + noise[1], LAYER: layer}
    assert reported(samples) == ([("reversed", LAYER)] if sign < 0 and moved == 1 else [])


def tall(storeys: int) -> BuildingDescription:
    """The paper's building with so many storeys."""
    own = paper()
    more = [Level(f"{n}th", "floor", 1e6) for n in range(storeys - len(own.floors))]
    return replace(own, levels=(*own.levels[:-1], *more, own.levels[-1]))


def found_in(description: BuildingDescription, samples: dict[str, Vector]) -> list[tuple[str, str, str | None]]:
    channels = tuple(channel for channel in description.channels if channel.id in samples)
    record = Record(START, RATE, channels, np.array([samples[channel.id] for channel in channels]))
    return [(one.kind, one.severity, one.channel) for one in disagreements(record, description)]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_first_mode_of_a_tall_building_is_no_fault(seed: int, sign: float) -> None:
    """Twenty storeys, at 0.62 Hz: a roof in resonance with the base slab's motion. A reversed one is still found."""
    base = motion(np.random.default_rng(seed), 0.6)
    top = roof(base, 0.62)
    samples = {BASE: base, FOURTH: (base + top) / 2, ROOF: sign * top}
    assert found_in(tall(20), samples) == ([] if sign > 0 else [("reversed", "warning", ROOF)])


def test_where_no_band_is_left_floors_are_not_judged_and_that_is_stated() -> None:
    """Forty storeys, at 0.33 Hz."""
    base = motion(np.random.default_rng(1), 0.4)
    samples = {BASE: base, ROOF: -roof(base, 0.33)}
    assert found_in(tall(40), samples) == [("tall", "note", None)]


def test_height_and_stiffness_say_how_long_a_building_moves_as_one_body() -> None:
    """Seven storeys of 8 m; one storey of 1000 t that has 0.9 Hz."""
    own = paper()
    high = replace(own, levels=(*own.levels[:2], *(replace(one, height=8.0) for one in own.floors)))
    one = Level("RF", "floor", 1e6, stiffness=(2 * np.pi * 0.9) ** 2 * 1e6)
    assert one_body_below(own) == 0.7
    assert one_body_below(high) == pytest.approx(0.7 / (0.02 * 8.0 * len(own.floors)))
    assert one_body_below(replace(own, levels=(*own.levels[:2], one))) == pytest.approx(0.63)


DESCRIPTION = read(torsion_building.building_file(), Path("/")).description


def test_one_motion_is_left_for_each_level_quantity_and_direction() -> None:
    reported = reconciled(record_of(DESCRIPTION.channels, torsion_building.records(1)), DESCRIPTION)
    assert reported.findings == ()
    keys = [(channel.level, channel.quantity, channel.direction) for channel in reported.record.channels]
    assert len(keys) == len(set(keys)) == 11
    x, y, _, _ = torsion_building.exact()
    for direction, truth in (("x", x), ("y", y)):
        measured = reported.record.find("1F", "displacement", direction)
        # the mean of two transducers, and what a torsion computed from them brings back
        assert measured == pytest.approx(truth, abs=6 * torsion_building.TRANSDUCER_NOISE)


def test_a_reversed_neighbour_is_excluded_and_the_other_represents_the_slab() -> None:
    samples = torsion_building.records(2)
    samples["XX.PAPER.B.HYX"] = -samples["XX.PAPER.B.HYX"]
    reported = reconciled(record_of(DESCRIPTION.channels, samples), DESCRIPTION)
    assert [(finding.kind, finding.channel) for finding in reported.findings] == [("reversed", "XX.PAPER.B.HYX")]
    # the two of y still give the torsion, and so x at the centre of mass
    measured = reported.record.find("1F", "displacement", "x")
    assert measured == pytest.approx(torsion_building.exact()[0], abs=6 * torsion_building.TRANSDUCER_NOISE)


def test_what_is_late_stays_and_what_is_turned_is_turned_back_before_it_is_judged() -> None:
    samples = turned(torsion_building.records(3), "XX.PAPER.08.HN", 30.0)
    samples["XX.PAPER.04.HNX"] = np.roll(samples["XX.PAPER.04.HNX"], 10)
    reported = reconciled(record_of(DESCRIPTION.channels, samples), DESCRIPTION)
    assert {(finding.kind, finding.channel) for finding in reported.findings} == {
        ("rotation", "XX.PAPER.08.HNX"),
        ("rotation", "XX.PAPER.08.HNY"),
        ("delay", "XX.PAPER.04.HNX"),
    }
    assert len(reported.record.channels) == 11


def test_one_of_two_sensors_of_the_base_slab_may_be_lost() -> None:
    """It is no fatal loss, and the event is analysed with the other."""
    pair = tuple(
        replace(channel, id=f"{channel.id}{corner}")
        for channel in DESCRIPTION.channels
        for corner in "PQ"
        if channel.id == "XX.PAPER.01.HNX"
    )
    others = [channel for channel in DESCRIPTION.channels if channel.id != "XX.PAPER.01.HNX"]
    described = replace(DESCRIPTION, channels=(*others, *pair))
    samples = torsion_building.records(4)
    both = samples.pop("XX.PAPER.01.HNX")
    result = analyse(segments(samples | {pair[0].id: both}), described, AnalysisSettings())
    assert {finding.severity for finding in result.quality} == {"warning"}
    assert set(result.directions) == {"x", "y"}
