from dataclasses import replace
from pathlib import Path

import numpy as np
import plan
import pytest
from biaxial import record_of, turned
from described import segments

from core.analysis import AnalysisSettings, analyse
from core.sensors.reconciliation import reconciled
from service.buildings.description import read

DESCRIPTION = read(plan.building_file(), Path("/")).description


def test_one_motion_is_left_for_each_level_quantity_and_direction() -> None:
    found = reconciled(record_of(DESCRIPTION.channels, plan.records(1)), DESCRIPTION)
    assert found.findings == ()
    keys = [(channel.level, channel.quantity, channel.direction) for channel in found.record.channels]
    assert len(keys) == len(set(keys)) == 11
    x, y, _, _ = plan.exact()
    for direction, truth in (("x", x), ("y", y)):
        measured = found.record.find("1F", "displacement", direction)
        # the mean of two transducers, and what a torsion computed from them brings back
        assert measured == pytest.approx(truth, abs=6 * plan.TRANSDUCER_NOISE)


def test_a_reversed_neighbour_is_left_out_and_the_other_stands_for_the_slab() -> None:
    samples = plan.records(2)
    samples["XX.PAPER.B.HYX"] = -samples["XX.PAPER.B.HYX"]
    found = reconciled(record_of(DESCRIPTION.channels, samples), DESCRIPTION)
    assert [(finding.kind, finding.channel) for finding in found.findings] == [("reversed", "XX.PAPER.B.HYX")]
    # the two of y still tell the torsion, and so x at the centre of mass
    measured = found.record.find("1F", "displacement", "x")
    assert measured == pytest.approx(plan.exact()[0], abs=6 * plan.TRANSDUCER_NOISE)


def test_what_is_late_stays_and_what_is_turned_is_turned_back_before_it_is_judged() -> None:
    samples = turned(plan.records(3), "XX.PAPER.08.HN", 30.0)
    samples["XX.PAPER.04.HNX"] = np.roll(samples["XX.PAPER.04.HNX"], 10)
    found = reconciled(record_of(DESCRIPTION.channels, samples), DESCRIPTION)
    assert {(finding.kind, finding.channel) for finding in found.findings} == {
        ("rotation", "XX.PAPER.08.HNX"),
        ("rotation", "XX.PAPER.08.HNY"),
        ("delay", "XX.PAPER.04.HNX"),
    }
    assert len(found.record.channels) == 11


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
    samples = plan.records(4)
    both = samples.pop("XX.PAPER.01.HNX")
    result = analyse(segments(samples | {pair[0].id: both}), described, AnalysisSettings())
    assert {finding.severity for finding in result.quality} == {"warning"}
    assert set(result.directions) == {"x", "y"}
