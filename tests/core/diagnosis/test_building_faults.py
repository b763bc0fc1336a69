"""Sensors are suspected before storeys, storeys before the mass; each suspicion states what cannot be distinguished."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from building_models import ROOF, paper
from consistent_records import consistent_record
from consistent_sensors import COUNT, RATE
from paper_records import FLOORS, START

from core.analysis import DirectionAnalysis, EventAnalysis
from core.arrays import Vector
from core.description import BuildingDescription, IsolationDesign
from core.diagnosis.building_faults import building_faults
from core.diagnosis.sensor_faults import Cause
from core.estimators.result import RestoringForce, StoreyStiffness
from core.fitting.fit import Fit
from core.fitting.search import Outcome
from core.model.first_model import first_model
from core.model.isolator import Isolator
from core.quality import Finding

DESIGN = IsolationDesign(k_b=475e6, c_b=6e6, F_y=655e3, D_y=1.5e-3)
SOUND: dict[str, Vector] = {}
LATE = {ROOF: np.array([0.0, 0.02, 0.0])}
SOFT = np.where(np.arange(7) == 4, np.log(0.7), 0.0)


def described() -> BuildingDescription:
    return replace(paper(), isolation=replace(paper().isolation, design=DESIGN))


def earthquakes(errors: Mapping[str, Vector], storeys: Vector, *quality: Finding) -> list[EventAnalysis]:
    """Two analyses, in which the storeys' stiffness is known to 2 %."""
    known = StoreyStiffness(storeys, np.eye(7) * 0.02**2, np.eye(7) * 100.0)
    nothing = np.zeros(COUNT)
    force = RestoringForce("smoother", nothing, nothing, nothing, nothing, (), storeys=known)
    return [
        EventAnalysis(
            start=START,
            rate=RATE,
            count=COUNT,
            directions={"x": DirectionAnalysis(force, None, ())},
            quality=quality,
            peaks={},
            pga=None,
            torsion=None,
            axial_load=None,
            refusal=None,
            record=consistent_record(errors, 0.03, [7, number]),
        )
        for number in range(2)
    ]


def fitted(mass: float) -> Fit:
    """The design's values except for a mass that is too large by a factor."""
    model = first_model(described()).isolator
    free = (("elastic", "k_b"), ("viscous", "c_b"), ("bouc_wen", "F_y"), ("bouc_wen", "D_y"))
    effects = {
        name: {key: value * (mass if key in ("k_b", "c_b", "F_y") else 1.0) for key, value in values.items()}
        for name, values in model.effects.items()
    }
    std = 0.002 * np.array([effects[name][key] for name, key in free])
    return Fit(Isolator(effects), free, np.diag(std**2), 1.0, np.zeros(1), Outcome.SETTLED, ())


def causes(errors: Mapping[str, Vector], storeys: Vector, mass: float, *quality: Finding) -> list[Cause]:
    return [s.cause for s in building_faults(earthquakes(errors, storeys, *quality), described(), fitted(mass))]


def test_a_building_as_described_is_not_suspected() -> None:
    assert causes(SOUND, np.zeros(7), 1.0) == []
    assert building_faults([], described()) == ()


def test_an_erring_sensor_that_stays_in_use_is_all_that_is_stated() -> None:
    assert causes(LATE, SOFT, 1.15) == [Cause.SENSOR]


def test_a_sensor_that_was_left_out_does_not_hide_the_rest() -> None:
    clipped = Finding("clipping", "warning", "lies flat at 3 m/s²", ROOF, 3.0)
    assert causes(SOUND, SOFT, 1.15, clipped) == [Cause.SENSOR, Cause.SUPERSTRUCTURE, Cause.MASS]


def test_a_softened_storey_is_named_with_what_it_lost() -> None:
    (found,) = building_faults(earthquakes(SOUND, SOFT), described(), fitted(1.0))
    assert (found.cause, found.kind, found.channel) == (Cause.SUPERSTRUCTURE, "storey", FLOORS[4])
    assert found.std is not None
    assert found.value == pytest.approx(-0.3, abs=4 * found.std)
    assert f"storey below '{FLOORS[4]}'" in found.message


@pytest.mark.parametrize(("mass", "printed"), [(1.12, "too large"), (0.88, "too small")])
def test_a_wrong_mass_says_what_it_cannot_be_distinguished_from(mass: float, printed: str) -> None:
    (found,) = building_faults(earthquakes(SOUND, np.zeros(7)), described(), fitted(mass))
    assert (found.cause, found.kind, found.channel) == (Cause.MASS, "mass", None)
    assert found.std is not None
    assert found.value == pytest.approx(mass - 1, abs=2 * found.std)
    assert printed in found.message
    assert "cannot distinguish this from isolators" in found.message


def test_without_a_fit_the_mass_is_not_judged() -> None:
    assert building_faults(earthquakes(SOUND, np.zeros(7)), described()) == ()
