from dataclasses import replace

import numpy as np
import pytest
from building_models import paper

from core.building import fixed_base_modes
from core.description import BuildingDescription
from core.errors import IdentificationError
from core.estimators.result import RestoringForce
from core.estimators.superstructure import known_superstructure
from core.identification.modes import Mode
from core.paper import BUILDING

TRUE = fixed_base_modes(BUILDING)


def force(size: float = 1.0, **known: object) -> RestoringForce:
    series = size * np.sin(np.arange(100.0))
    return RestoringForce("an estimator", series, series, 0 * series, np.ones(100), **{"modes": (), **known})  # type: ignore[arg-type]


def designed() -> BuildingDescription:
    description = paper()
    floors = tuple(
        replace(level, stiffness=2.0 * float(stiffness))
        for level, stiffness in zip(description.floors, BUILDING.storey_stiffness, strict=True)
    )
    return replace(description, levels=(*description.levels[:2], *floors))


def test_a_calibrated_superstructure_goes_before_all_others_that_of_the_strongest_motion_first() -> None:
    other = replace(TRUE, angular_frequency=2 * TRUE.angular_frequency)
    result = known_superstructure(
        [force(1.0, superstructure=other), force(3.0, superstructure=TRUE), force(9.0)], paper()
    )
    assert result.modes is TRUE
    assert "calibrated" in result.source


def test_a_design_that_is_too_stiff_is_scaled_to_the_identified_mode() -> None:
    mode = Mode(float(TRUE.frequency[0]), 0.01, TRUE.shape[:, 0])
    result = known_superstructure([force(modes=(mode,))], designed())
    assert result.modes.frequency == pytest.approx(TRUE.frequency)
    assert result.modes.damping_ratio[0] == pytest.approx(0.01)
    assert "1.09 Hz" in result.source


def test_without_any_record_it_is_the_designs() -> None:
    result = known_superstructure([force()], designed())
    assert result.modes.frequency == pytest.approx(np.sqrt(2) * TRUE.frequency)
    assert "no record determines it" in result.source


def test_masses_alone_and_a_mode_make_a_shear_building() -> None:
    result = known_superstructure([force(modes=(Mode(1.5, 0.02, TRUE.shape[:, 0]),))], paper())
    assert result.modes.frequency[0] == pytest.approx(1.5)
    assert "as stiff as the floor above is heavy" in result.source


def test_nothing_is_reported_as_nothing() -> None:
    with pytest.raises(IdentificationError, match="that of every storey in the building file would help"):
        known_superstructure([force()], paper())
