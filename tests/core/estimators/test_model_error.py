"""Effect of uncertain masses on the force's standard deviation."""

from dataclasses import replace

import numpy as np
import pytest
from band_coverage import Case, coverage, recorded
from building_models import paper, segments

from core.analysis import AnalysisSettings, analyse
from core.description import BuildingDescription
from core.errors import ModelError
from core.fitting.observation import observations

CASE = Case("all masses ±20 %", "AKT013", 15.0, 0.01, 1)


def doubted(share: float) -> BuildingDescription:
    described = paper()
    return replace(described, levels=tuple(replace(level, mass_uncertainty=share) for level in described.levels))


@pytest.mark.accuracy
@pytest.mark.parametrize("seed", [1, 3])
def test_the_band_holds_the_force_of_a_building_whose_masses_are_as_uncertain_as_given(seed: int) -> None:
    plain, given = (
        coverage(replace(CASE, truth=truth, seed=seed)) for truth in ("all masses ±20 %", "all masses ±20 %, as given")
    )
    assert plain.force.inside < 0.75
    assert 0.90 <= given.force.inside <= 0.985
    assert given.force.error == plain.force.error
    assert given.k_inside >= 0.9 * given.cycles


def test_models_are_fitted_alike_whatever_the_masses_uncertainty() -> None:
    made = segments(recorded(CASE))
    exact, given = (analyse(made, doubted(share), AnalysisSettings()) for share in (0.0, 0.2))
    wide, narrow = given.directions["x"].restoring_force, exact.directions["x"].restoring_force
    assert np.mean(wide.std) > 5 * np.mean(narrow.std)
    (one,), (other,) = (observations(result, doubted(0.0), "event", result.start) for result in (exact, given))
    for name in ("force", "force_std", "displacement", "displacement_std", "velocity", "velocity_std"):
        assert np.array_equal(getattr(one.layer, name), getattr(other.layer, name)), name


@pytest.mark.parametrize("share", [-0.1, 1.0, float("nan")])
def test_an_uncertainty_that_is_no_share_is_refused(share: float) -> None:
    with pytest.raises(ModelError, match="mass_uncertainty"):
        doubted(share)
