"""Standard deviations that are predicted for one more sensor, against those that its record then gives."""

from dataclasses import replace

import numpy as np
import pytest
from building_models import bncs, bncs_segments, paper, records as sensors, segments
from ground_motions import RATE, akt013
from shared_data import needs_shared

import core
from core.analysis import EventAnalysis, analyse
from core.arrays import Vector
from core.description import BuildingDescription
from core.model.simulation import simulate
from core.paper import BUILDING, ISOLATOR
from core.record import Channel
from core.workbench import AddedSensors

NOISE = 0.01
"""Over the root mean square, of every channel."""


def described(*levels: str) -> BuildingDescription:
    """The paper's building with its storeys, and more accelerometers."""
    one = paper()
    floors = zip(one.levels[2:], BUILDING.storey_stiffness, strict=True)
    own = tuple(Channel(f"XX.PAPER.{level}.HNX", level, "acceleration", "x") for level in levels)
    return replace(
        one,
        levels=(*one.levels[:2], *(replace(level, stiffness=float(k)) for level, k in floors)),
        channels=(*one.channels, *own),
    )


def measured(*levels: str) -> dict[str, Vector]:
    """Records of the building's sensors, and of more levels."""
    moved, rng = simulate(BUILDING, ISOLATOR, akt013(), RATE).floor_acceleration, np.random.default_rng(5)
    exact = dict(zip([one.name for one in described().floors], moved, strict=True))
    noisy = {name: one + NOISE * one.std() * rng.standard_normal(one.size) for name, one in exact.items()}
    return sensors(1, NOISE) | {f"XX.PAPER.{level}.HNX": noisy[level] for level in levels}


def deviation(analysis: EventAnalysis) -> float:
    noise = analysis.directions["x"].restoring_force.noise_std
    assert noise is not None
    return float(np.sqrt(np.mean(noise**2)))


@pytest.fixture(scope="module")
def today() -> EventAnalysis:
    return analyse(segments(measured()), described())


@pytest.fixture(scope="module")
def found(today: EventAnalysis) -> AddedSensors:
    """Added sensors by one record."""
    return core.added_sensors([today], described())


@pytest.mark.accuracy
def test_the_force_becomes_as_narrow_as_predicted(today: EventAnalysis, found: AddedSensors) -> None:
    """4 %: the noise of one record against that of another, and modes that the record determines a little less well."""
    assert {one.level for one in found.sensors} == {"2F", "3F", "5F", "6F", "7F"}
    assert found.today[0].force == pytest.approx(deviation(today), rel=1e-6)
    by_level = {one.level: one for one in found.sensors}
    for level in ("2F", "6F"):
        really = analyse(segments(measured(level)), described(level))
        assert by_level[level].force == pytest.approx(deviation(really), rel=0.04), level
        assert by_level[level].force_ratio == pytest.approx(by_level[level].force / deviation(today))
        assert 0.8 < by_level[level].force_ratio < 0.95
    for one in found.sensors:
        assert np.all(one.frequency_ratios < 1), "a sensor takes nothing away"
        assert np.all(one.damping_ratios < 1)
    assert f"One more accelerometer at {found.sensors[0].level} would make it" in " ".join(str(found).split())


def test_a_sensor_between_base_and_roof_tells_more_than_one_beside_the_roof() -> None:
    """With base and roof alone, the first mode's shape is open; the real gain is larger, as the text says."""
    whole = described()
    alone = replace(whole, channels=tuple(one for one in whole.channels if one.level != "4F"))
    analysis = analyse(segments(sensors(1, NOISE)), alone)
    found = core.added_sensors([analysis], alone)
    ratios = {one.level: one.force_ratio for one in found.sensors}
    assert ratios["4F"] < 0.5 < ratios["7F"] < 1
    really = deviation(analyse(segments(sensors(1, NOISE)), whole)) / deviation(analysis)
    assert really < ratios["4F"]
    assert "narrows the force more than this" in " ".join(str(found).split())


@needs_shared
@pytest.mark.slow
def test_a_real_building_gains_what_was_predicted() -> None:
    """20 %, where noise does not explain all that the superstructure leaves of the record."""
    whole, record = bncs(), bncs_segments("CNP100")

    def with_sensors(*levels: str) -> BuildingDescription:
        own = (one for one in whole.channels if one.quantity != "acceleration" or one.level in levels)
        return replace(whole, channels=tuple(own))

    few, more = ("foundation", "base slab", "4", "roof"), "3"
    analysis = analyse(record, with_sensors(*few))
    found = core.added_sensors([analysis], with_sensors(*few))
    assert [one.level for one in found.sensors] == ["3", "2", "5"]
    really = deviation(analyse(record, with_sensors(*few, more))) / deviation(analysis)
    assert found.sensors[0].force_ratio == pytest.approx(really, rel=0.2)


def test_several_records_count_together(today: EventAnalysis, found: AddedSensors) -> None:
    twice = core.added_sensors([today, today], described())
    assert twice.today[0].records == 2
    for one, other in zip(found.sensors, twice.sensors, strict=True):
        assert (one.level, one.force) == (other.level, pytest.approx(other.force))


def test_nothing_to_learn_from_is_refused() -> None:
    with pytest.raises(core.RecordError, match="no record has a force"):
        core.added_sensors([analyse([], described())], described())
