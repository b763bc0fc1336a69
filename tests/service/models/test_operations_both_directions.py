"""A model of both directions, which are coupled: diagnosed, and reported direction by direction."""

from dataclasses import replace
from datetime import timedelta
from io import StringIO

import pytest
from biaxial_observations import COUPLED, biaxial_observation
from building_models import paper
from layer_observations import START
from records_from_observations import records_from_observations
from rich.console import Console

from core.diagnosis.missing_effects import Outcome
from core.model.isolator import Isolator
from core.paper import BUILDING
from core.workbench.diagnosis_result import DiagnosisResult
from core.workbench.earthquakes import Earthquakes
from service.documents.html import page
from service.documents.text import printed
from service.jobs.stages import silent
from service.models import documents, report
from service.models.model_file import ModelFile, read, written
from service.models.operations import Work, compare, diagnose
from service.models.results import as_json

GIVEN = ModelFile("PAPER", "xy", Isolator({n: v for n, v in COUPLED.effects.items() if n != "biaxial"}))
OFFERED = ("biaxial", "friction", "hardening", "asymmetry")
LATER = START + timedelta(days=1)


@pytest.fixture(scope="module")
def seen() -> Earthquakes:
    """Two earthquakes in both directions; the second is left out."""
    later = biaxial_observation(2, scale=0.7, start=LATER)
    made = records_from_observations([*biaxial_observation(1), *later], {later[0].name})
    levels = {floor.name: k for floor, k in zip(paper().floors, BUILDING.storey_stiffness, strict=True)}
    known = [replace(level, stiffness=levels.get(level.name)) for level in made.description.levels]
    return replace(made, description=replace(made.description, levels=tuple(known)))


@pytest.fixture(scope="module")
def found(seen: Earthquakes) -> Work[DiagnosisResult]:
    return diagnose(GIVEN, "given.toml", seen, silent, OFFERED)


def text_of(renderable: object) -> str:
    console = Console(width=120, record=True, file=StringIO())
    console.print(renderable)
    return console.export_text()


def test_the_coupling_is_named_and_lowers_the_error_in_both_directions_of_a_held_out_earthquake(
    found: Work[DiagnosisResult],
) -> None:
    assert found.result.diagnosis.outcome is Outcome.EFFECT
    assert [stage.effect for stage in found.result.stages] == ["biaxial"]
    (left_out,) = found.result.earthquakes.held_out
    for direction in ("x", "y"):
        before, after = (
            version.errors.of([left_out]).along(direction).forces[0].misfit for version in found.result.versions[1:]
        )
        assert after.nrmse < 0.5 * before.nrmse
        assert after.noise_ratio < 1.2


def test_the_model_that_comes_of_it_is_of_both_directions(found: Work[DiagnosisResult]) -> None:
    again = read(written(found.model))
    assert (again.direction, again.directions) == ("xy", ("x", "y"))
    assert again.isolator.effects["biaxial"]["joined"] == pytest.approx(1.0, abs=0.1)


def test_tables_and_json_show_each_direction(found: Work[DiagnosisResult]) -> None:
    names = [one.name for one in found.result.earthquakes.observations]
    shown = text_of(printed(report.diagnosis(found)))
    for name, direction in zip(names, "xyxy", strict=True):
        assert shown.count(f"{name} {direction}") == 2  # of the force, and of the response to the ground alone
    before, after = (version["events"] for version in as_json(documents.diagnosis(found))["versions"][1:])
    assert [(one["name"], one["direction"]) for one in after] == list(zip(names, "xyxy", strict=True))
    for was, now in zip(before, after, strict=True):
        assert now["prediction"]["displacement"]["nrmse"] < was["prediction"]["displacement"]["nrmse"]


def test_pictures_show_both_directions_of_the_strongest_earthquake(found: Work[DiagnosisResult]) -> None:
    made = page(report.diagnosis_file(found))
    for picture in ("loop", "histories"):
        drawn = made.split(f'<figure id="{picture}">')[1].split("</figure>")[0]
        assert "direction x" in drawn
        assert "direction y" in drawn
    points = made.split('<figure id="stiffness">')[1].split("</figure>")[0]
    assert f"{found.result.earthquakes.observations[0].name} y" in points


def test_a_comparison_shows_each_direction(seen: Earthquakes) -> None:
    shown = text_of(printed(report.comparison(compare(replace(GIVEN, isolator=COUPLED), seen, silent))))
    for one in seen.observations:
        assert shown.count(f"{one.name} {one.direction}") == 2
