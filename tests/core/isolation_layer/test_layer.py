from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
import torsion_building
from biaxial_records import record_of
from building_models import paper

from core.description import BuildingDescription
from core.isolation_layer.layer import GRAVITY, axial_load, layer_motion, layer_torsion
from core.record import Channel, Record
from core.sensors.reconciliation import reconciled
from core.sensors.rigid import RigidLevels
from service.buildings.description import read

DESCRIPTION = read(torsion_building.building_file(), Path("/")).description


def levels(samples: dict[str, np.ndarray], description: BuildingDescription = DESCRIPTION) -> RigidLevels:
    return reconciled(record_of(description.channels, samples), description)


def test_transducers_at_two_corners_give_translation_and_torsion_with_their_errors() -> None:
    """Each sensor alone is off by the torsion, some 20 % of x; measured: 95, 95 and 97 % within 95 % bands."""
    result = levels(torsion_building.records(1))
    x, y, torsion, _ = torsion_building.exact()
    truths = {"x": x, "y": y}
    motions = {name: layer_motion(result.record, DESCRIPTION, name)[0] for name in ("x", "y")}
    turned, findings = layer_torsion(result, DESCRIPTION)
    assert findings == ()
    for motion, truth in ((motions["x"], truths["x"]), (motions["y"], truths["y"]), (turned, torsion)):
        assert motion is not None
        assert motion.band[0] == 0.0
        covered = np.mean(np.abs(motion.displacement - truth) < 1.96 * motion.displacement_std)
        assert covered == pytest.approx(0.95, abs=0.03)


def test_accelerometers_at_two_corners_give_a_torsion_above_a_frequency() -> None:
    """The base slab's accelerometers in the corners' place; the ground is assumed not to turn."""
    samples, accelerometers = torsion_building.records(2), list[Channel]()
    x, _, torsion, _ = torsion_building.exact()
    turning = np.gradient(np.gradient(torsion)) * 100.0**2
    rng = np.random.default_rng(3)
    for corner, (_, north) in torsion_building.CORNERS.items():
        name = f"XX.PAPER.{corner}.HNX"
        accelerometers.append(Channel(name, "1F", "acceleration", "x", torsion_building.CORNERS[corner]))
        samples[name] = samples["XX.PAPER.01.HNX"] - turning * north + 1e-4 * rng.standard_normal(x.size)
    others = tuple(
        c
        for c in DESCRIPTION.channels
        if c.quantity != "displacement" and c.id not in ("XX.PAPER.01.HNX", torsion_building.VERTICAL)
    )
    described = replace(DESCRIPTION, channels=(*others, *accelerometers))
    turned, findings = layer_torsion(levels(samples, described), described)
    assert turned is not None
    assert [(finding.kind, finding.severity, finding.value) for finding in findings] == [
        ("displacement", "note", turned.band[0])
    ]
    assert f"{turned.band[0]:.2g} Hz" in findings[0].message
    assert turned.residual is None
    assert np.mean(np.abs(turned.displacement - torsion) < 1.96 * turned.displacement_std) > 0.93


def test_without_positions_there_is_no_torsion() -> None:
    channels = tuple(replace(channel, position=None) for channel in DESCRIPTION.channels)
    described = replace(DESCRIPTION, channels=channels)
    motions = levels(torsion_building.records(4), described)
    assert layer_torsion(motions, described) == (None, ())
    assert {finding.kind for finding in motions.findings} == {"position"}


def test_a_displacement_that_is_only_noise_is_no_motion() -> None:
    noise = 1e-4 * np.random.default_rng(5).standard_normal(18000)
    name = f"{torsion_building.LAYER}X"
    channel = Channel(name, "1F", "displacement", "x")
    motion, findings = layer_motion(record_of((channel,), {name: noise}), DESCRIPTION, "x")
    assert motion is None
    assert [(finding.kind, finding.severity) for finding in findings] == [("displacement", "warning")]
    assert "above its noise" in findings[0].message


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
def test_a_substitute_level_is_used_and_named(levels: tuple[str, ...], used: str) -> None:
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
