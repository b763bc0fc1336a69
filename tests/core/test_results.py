"""Results can be kept, sent to another process and put into a set: each is pickled, copied and hashed."""

import copy
import pickle
from dataclasses import fields, is_dataclass

import numpy as np
import pytest
from building_models import paper, records, segments
from paper_records import START
from synthetic_observations import BOUC_WEN, observations

from core.analysis import AnalysisSettings, analyse
from core.comparison.compared import compare_forces
from core.comparison.failure import failure
from core.comparison.prediction import predict_all
from core.diagnosis.missing_effects import diagnosed
from core.effects import EFFECTS
from core.estimators.superstructure import known_superstructure
from core.fitting.data import FitData
from core.fitting.fit import at_values, weighted_fit
from core.fitting.observation import observations as observations_of
from core.model.isolator import Isolator

BAND = (0.1, 30.0)
HARD = Isolator({**BOUC_WEN.effects, "hardening": {"k3": 2e10, "k5": 0.0}})


@pytest.fixture(scope="module")
def results() -> dict[str, object]:
    """By name, of the chain from an analysis to a diagnosis."""
    seen = observations(HARD, 0.02, 3, peaks=(0.02, 0.06))
    data = FitData.by_noise(seen)
    compared = compare_forces(BOUC_WEN, seen, BAND)
    analysis = analyse(segments(records(1)), paper(), AnalysisSettings(estimator="smoother"))
    forces = compare_forces(BOUC_WEN, observations_of(analysis, paper(), "one", START), BAND)
    superstructure = known_superstructure([analysis.directions["x"].restoring_force], paper())
    return {
        "isolator": HARD,
        "analysis": analysis,
        "observation": seen[0],
        "fit": at_values(data, BOUC_WEN),
        "data": data,
        "weighed fit": weighted_fit(seen, BOUC_WEN),
        "comparison": compared[0],
        "failure": failure(compared, np.random.default_rng(1)),
        "predictions": predict_all(forces, {"x": superstructure.modes}, BOUC_WEN, paper(), BAND),
        "diagnosis": diagnosed(seen, BOUC_WEN, ("hardening", "friction")),
    }


def parts(value: object) -> list[object]:
    """The value and all values within it."""
    if is_dataclass(value):
        inside: list[object] = [getattr(value, field.name) for field in fields(value)]
    elif isinstance(value, dict):
        inside = list(value.values())
    else:
        inside = list(value) if isinstance(value, tuple) else []
    return [value, *(part for one in inside for part in parts(one))]


def test_every_result_is_pickled_and_copied(results: dict[str, object]) -> None:
    for name, result in results.items():
        for other in (pickle.loads(pickle.dumps(result)), copy.copy(result), copy.deepcopy(result)):
            for one, same in zip(parts(result), parts(other), strict=True):
                assert type(same) is type(one), name
                if isinstance(one, np.ndarray):
                    assert np.array_equal(one, same, equal_nan=one.dtype.kind == "f"), name
                elif isinstance(one, str | float | int):
                    assert one == same or one != one, name


def test_every_value_in_a_result_is_hashed(results: dict[str, object]) -> None:
    for name, result in results.items():
        for part in parts(result):
            if is_dataclass(part):
                assert isinstance(hash(part), int), (name, type(part))


def test_a_result_holds_no_columns_of_the_search_that_made_it(results: dict[str, object]) -> None:
    """They may be 200 MB."""
    data = [part for part in parts(results["diagnosis"]) if isinstance(part, FitData)]
    assert data
    assert all(one.memory.size == 0 for one in data)


def test_an_isolator_stays_as_it_was_made() -> None:
    values = {"k_b": 4e8}
    one = Isolator({"elastic": values})
    values["k_b"] = 5e8
    assert one == Isolator({"elastic": {"k_b": 4e8}})
    assert {one: 1}[pickle.loads(pickle.dumps(one))] == 1
    for change in (one.effects, one.effects["elastic"], EFFECTS["elastic"].absent):
        with pytest.raises(TypeError, match="frozen"):
            change["k_b"] = 1.0  # type: ignore[index]
