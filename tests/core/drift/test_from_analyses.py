"""Series from analyses: what a notebook gets without a database, and the judgement that follows."""

import pickle
from dataclasses import replace
from datetime import timedelta

import numpy as np
import pytest
import stored_histories
from building_models import BASE, GROUND, LAYER, paper

import core
from core.drift.from_analyses import channels_of, sensor_notes
from core.drift.series import Series
from core.record import Finding

COUNT, ONSET = 30, 24


@pytest.fixture(scope="module")
def series() -> dict[tuple[str, str], Series]:
    return core.drift_series(stored_histories.store_history(COUNT, ONSET))


def test_every_quantity_of_the_analyses_has_its_series(series: dict[tuple[str, str], Series]) -> None:
    of_sensors = {(quantity, channel) for quantity in ("gain", "noise") for channel in (GROUND, BASE, LAYER)}
    of_layer = {(quantity, "x") for quantity in ("stiffness", "damping", "residual_displacement")}
    assert series.keys() == {*of_sensors, *of_layer, ("frequency", "x/1"), ("frequency", "x/2")}
    assert len(series["stiffness", "x"].measurements) == COUNT * stored_histories.CYCLES
    assert len(series["frequency", "x/2"].measurements) == COUNT


def test_a_measurement_has_the_numbers_of_its_analysis(series: dict[tuple[str, str], Series]) -> None:
    analysis = stored_histories.store_history(COUNT, ONSET)[3]
    result = analysis.directions["x"]
    cycle, first = result.equivalent[0], series["stiffness", "x"].measurements[3 * stored_histories.CYCLES]
    assert (first.event, first.value, first.std) == (3, cycle.k_eq, cycle.k_eq_std)
    assert (first.amplitude, first.temperature) == (cycle.amplitude, analysis.temperature)
    assert first.time == analysis.start + timedelta(seconds=(cycle.start + cycle.end) / 2)
    assert series["frequency", "x/1"].measurements[3].amplitude == result.restoring_force.peak[0]
    assert series["gain", BASE].measurements[3].value == analysis.sensors[1].gain


def test_a_loss_in_the_analyses_raises_an_alarm_that_is_printed(series: dict[tuple[str, str], Series]) -> None:
    judged = core.monitor(series["stiffness", "x"])
    (alarm,) = (one for one in judged.alarms if one.is_sure)
    assert (alarm.rule, alarm.onset) == ("sudden", ONSET)
    assert "The stiffness of the isolation layer has changed by −" in " ".join(str(judged).split())
    assert str(pickle.loads(pickle.dumps(judged))) == str(judged)
    assert "No change was found" in str(
        core.monitor(core.drift_series(stored_histories.store_history(COUNT))["stiffness", "x"])
    )


def test_too_few_events_are_stated(series: dict[tuple[str, str], Series]) -> None:
    few = core.drift_series(stored_histories.store_history(5))
    assert "needs 15 more events" in " ".join(str(core.monitor(few["stiffness", "x"])).split())


def test_rejected_events_give_nothing_of_the_layer() -> None:
    one, other = stored_histories.store_history(2)
    series = core.drift_series((one, replace(other, directions={}, refusal="no base slab")))
    assert {measured.event for measured in series["stiffness", "x"].measurements} == {0}
    assert {measured.event for measured in series["gain", BASE].measurements} == {0, 1}


def test_modes_at_other_floors_than_the_latest_are_omitted() -> None:
    *earlier, last = stored_histories.store_history(4)
    result = last.directions["x"]
    modes = tuple(replace(mode, shape=np.append(mode.shape, 1.0)) for mode in result.restoring_force.modes)
    changed = replace(result, restoring_force=replace(result.restoring_force, modes=modes))
    series = core.drift_series((*earlier, replace(last, directions={"x": changed})))
    assert {one.event for one in series["frequency", "x/1"].measurements} == {3}


def test_findings_on_the_channels_of_a_series_are_noted_unless_a_sensor_is_missing() -> None:
    gap, gone, other = (
        Finding("gap", "warning", "a gap", BASE),
        Finding("missing", "warning", "not recorded", BASE),
        Finding("gap", "warning", "a gap", GROUND),
    )
    notes = sensor_notes({1: [gap], 2: [gone], 3: [other], 4: [gone, gap]}, (BASE,))
    assert {event: note.sensor_findings for event, note in notes.items()} == {1: (gap,), 4: (gap,)}


def test_a_series_is_measured_by_the_channels_of_its_direction_or_by_its_own() -> None:
    description = paper()
    assert channels_of(Series("gain", BASE, ()), description) == (BASE,)
    along = channels_of(Series("frequency", "x/1", ()), description)
    assert set(along) == {one.id for one in description.channels if one.direction == "x"}
