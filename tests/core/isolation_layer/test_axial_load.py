from datetime import UTC, datetime

import numpy as np
import pytest
from described import paper

from core.isolation_layer.axial_load import GRAVITY, axial_load
from core.record import Channel, Record

TIME = np.arange(6000) / 100
VERTICAL = 0.3 * GRAVITY * np.sin(2 * np.pi * 5 * TIME) * np.exp(-(((TIME - 30) / 8) ** 2))
BAND = (0.1, 30.0)


def record(*levels: str) -> Record:
    channels = tuple(Channel(f"XX.PAPER.{level}.HNZ", level, "acceleration", "z") for level in levels)
    return Record(datetime(2024, 1, 1, tzinfo=UTC), 100.0, channels, np.tile(VERTICAL, (len(levels), 1)))


def test_the_load_rises_with_the_slabs_upward_acceleration() -> None:
    load, findings = axial_load(record("ground", "RF", "1F"), paper(), BAND)
    assert load is not None
    assert load.level == "1F"
    assert findings == ()
    # the pass band keeps 5 Hz to a thousandth
    assert load.ratio == pytest.approx(1 + VERTICAL / GRAVITY, abs=1e-3)


@pytest.mark.parametrize(("levels", "used"), [(("ground", "RF"), "RF"), (("ground",), "ground")])
def test_another_level_stands_in_and_is_named(levels: tuple[str, ...], used: str) -> None:
    load, findings = axial_load(record(*levels), paper(), BAND)
    assert load is not None
    assert load.level == used
    assert [(finding.kind, finding.severity) for finding in findings] == [("axial_load", "note")]
    assert repr(used) in findings[0].message


def test_without_a_vertical_channel_there_is_none() -> None:
    horizontal = Record(
        datetime(2024, 1, 1, tzinfo=UTC), 100.0, (Channel("X", "1F", "acceleration", "x"),), VERTICAL[None, :]
    )
    assert axial_load(horizontal, paper(), BAND) == (None, ())
