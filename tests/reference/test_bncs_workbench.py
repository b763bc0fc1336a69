"""A real building's two weaker earthquakes show hysteresis, and predict the force of the strongest."""

from datetime import UTC, datetime
from pathlib import Path

import pytest
from shared_data import BNCS, needs_shared

from core.analysis import AnalysisSettings, analyse
from core.comparison.compared import compare_forces
from core.diagnosis.missing_effects import diagnosed
from core.effects import EFFECTS
from core.fitting.observation import Observation, observations
from core.isolation_layer.motion import Integral
from core.model.isolator import Isolator
from service.cli.inputs import read_building, read_usable_records
from service.jobs.stages import silent
from service.models.operations import improve
from service.records.event_files import events

pytestmark = [pytest.mark.accuracy, needs_shared]

BAND = (0.1, 25.0)
"""Hz."""
HYSTERETIC = {"hysteresis", "parallel hysteresis", "dry friction"}
"""Families of what dissipates at any speed."""
LINEAR = Isolator({"elastic": {"k_b": 4e6}, "viscous": {"c_b": 1e5}})
"""About what the masses and a period of 2.5 s ask for."""


@pytest.fixture(scope="module")
def seen() -> list[Observation]:
    """CNP100, LAC100 and SP100, in the order of the tests."""
    building = read_building(BNCS / "building.toml")
    files = [path for path in sorted(BNCS.iterdir()) if path.suffix in {".mseed", ".xml"}]
    results = [
        one
        for event in events(files, building)
        for one in observations(
            analyse(event.segments, building.description, AnalysisSettings(band=BAND)),
            building.description,
            f"{event.start:%d}",
            datetime(2012, 1, 1, tzinfo=UTC),
        )
    ]
    return sorted(results, key=lambda one: one.start)


def error(model: Isolator, of: list[Observation]) -> float:
    """Error of the last force, root mean square over root mean square."""
    misfit = compare_forces(model, of, BAND)[-1].misfit
    return float((misfit.error / misfit.signal) ** 0.5)


@pytest.mark.parametrize(
    ("file", "option", "is_restored"),
    [("", None, True), ('integral = "recorded"', None, False), ('integral = "recorded"', "restored", True)],
)
def test_the_slow_motion_is_restored_for_an_improvement_unless_the_model_is_of_the_recorded_one(
    tmp_path: Path, file: str, option: Integral | None, is_restored: bool
) -> None:
    """The option is decisive, then the model file; the model that is made says which."""
    model = tmp_path / "model.toml"
    values = "[effects.elastic]\nk_b = 4e6\n[effects.viscous]\nc_b = 1e5\n"
    model.write_text(f'building = "BNCS"\ndirection = "x"\n{file}\n{values}')
    files = [BNCS / "CNP100.mseed", BNCS / "station.xml"]
    given, seen = read_usable_records(model, files, BNCS / "building.toml", silent, (), option, "restored")
    assert seen.motion_is_restored is is_restored
    made = improve(given, model.name, seen, silent, ())
    assert made.model.integral == ("restored" if is_restored else "recorded")
    offered = "can be restored by the setting" if not is_restored else "was restored down to 0.06 Hz"
    assert offered in " ".join(made.result.text)


def test_hysteresis_is_detected_missing_and_predicts_the_strongest_earthquake(seen: list[Observation]) -> None:
    """`menshin model improve` with SP100 held out prints 29.1 % refitted and 11.6 % with two effects."""
    diagnosis = diagnosed(seen[:2], LINEAR)
    assert diagnosis.steps
    assert EFFECTS[diagnosis.steps[0].chosen.effect].family in HYSTERETIC
    assert error(diagnosis.refitted.model, seen) > 0.25
    assert error(diagnosis.after.model, seen) < 0.13
