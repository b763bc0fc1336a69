"""Output of a diagnosis for an engineer: text, JSON, page and better model; core does the reasoning."""

import json
import re
from dataclasses import replace
from io import StringIO
from typing import Any

import numpy as np
import orjson
import pytest
from hypothesis import given, settings, strategies as st
from records_from_observations import records_from_observations
from rich.console import Console
from synthetic_observations import BOUC_WEN, observations

from core.diagnosis.effect_search import LOWERS
from core.diagnosis.missing_effects import Outcome
from core.diagnosis.ranking import Dropped
from core.diagnosis.sensor_faults import BuildingFault, Cause
from core.diagnosis.worth import NoiseRatios, worth
from core.effects import EFFECTS
from core.model.isolator import Isolator
from core.workbench.diagnosis_result import DiagnosisResult
from core.workbench.earthquakes import Version, lowers
from core.workbench.improving import ImprovementResult
from service.documents.document import Figure
from service.documents.html import page
from service.documents.text import printed
from service.jobs.stages import silent
from service.models import documents, report
from service.models.model_file import ModelFile, read, written
from service.models.operations import Work, add, diagnose, improve, work
from service.models.results import as_json

OFFERED = ("friction", "hardening", "power_viscous")
HARD = Isolator({**BOUC_WEN.effects, "hardening": {"k3": 2e10, "k5": 0.0}})
PEAKS = (0.01, 0.08, 0.03, 0.06)
GIVEN = ModelFile("PAPER", "x", BOUC_WEN)
FAR = ModelFile(
    "PAPER",
    "x",
    Isolator(
        {
            name: {k: 1.3 * v if k in ("k_b", "F_y") else v for k, v in vs.items()}
            for name, vs in BOUC_WEN.effects.items()
        }
    ),
)


def through_json(document: dict[str, Any]) -> dict[str, Any]:
    """As a program reads it that knows no NaN."""

    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    loaded: dict[str, Any] = json.loads(orjson.dumps(document), parse_constant=refuse)
    return loaded


@pytest.fixture(scope="module")
def hard() -> Work[DiagnosisResult]:
    """Hardening is hidden; the last of four earthquakes is left out."""
    seen = observations(HARD, 0.01, 7, PEAKS)
    return diagnose(GIVEN, "given.toml", records_from_observations(seen, {"event 3"}), silent, OFFERED)


@pytest.fixture(scope="module")
def diagnosed(hard: Work[DiagnosisResult]) -> DiagnosisResult:
    return hard.result


@pytest.fixture(scope="module")
def document(hard: Work[DiagnosisResult]) -> dict[str, Any]:
    return through_json(as_json(documents.diagnosis(hard)))


def test_the_document_names_the_effect_with_its_evidence(document: dict[str, Any]) -> None:
    assert document["outcome"] == "effect"
    assert document["set"] == ["hardening"]
    assert [step["effect"] for step in document["steps"]] == ["hardening"]
    assert document["unknown_flag"] is False
    assert document["resembles"] == []
    assert document["unexplained"]["of_excess"] == pytest.approx(0.0, abs=0.02)
    assert document["unexplained"]["of_excess_held_out"] == pytest.approx(0.0, abs=0.02)
    assert document["steps"][0]["share"] == pytest.approx(1.0, abs=0.02)
    assert document["steps"][0]["share_held_out"] == pytest.approx(1.0, abs=0.02)
    first = document["candidates"][0]
    assert (first["effect"], first["family"], first["plausible"]) == ("hardening", EFFECTS["hardening"].family, True)
    assert first["delta_bic"] < -10
    assert first["error_after"] < 0.5 * first["error_before"]
    assert first["error_after"] == pytest.approx(first["noise_floor"], rel=0.1)
    assert first["error_after_held_out"] < 0.5 * document["versions"][1]["error_held_out"]["rms"]
    k3 = first["parameters"]["k3"]
    assert k3["value"] == pytest.approx(2e10, abs=4 * k3["std"])
    assert k3["unit"] == "N/m^3"


def test_every_effect_that_was_offered_is_reported_with(document: dict[str, Any]) -> None:
    assert {one["effect"] for one in document["candidates"]} == set(OFFERED)
    assert all((one["reason"] is None) == one["plausible"] for one in document["candidates"])


def test_the_text_names_the_missing_effect_and_its_gain_on_held_out_earthquakes(
    hard: Work[DiagnosisResult], document: dict[str, Any]
) -> None:
    text = document["explanation"]
    assert text.startswith(f"{EFFECTS['hardening'].title} (hardening) is missing.")
    assert "on held-out earthquakes" in text
    assert "The error falls only for the fitted earthquakes" not in text


def test_the_terminal_shows_the_errors_of_every_version(hard: Work[DiagnosisResult]) -> None:
    console = Console(width=100, record=True, file=StringIO())
    console.print(printed(report.diagnosis(hard)))
    shown = console.export_text()
    for expected in ("as given", "refitted", "with hardening", "(held out)", "ΔBIC", "the record is too short"):
        assert expected in shown


def test_the_page_has_the_six_pictures_and_the_text(hard: Work[DiagnosisResult]) -> None:
    made = page(report.diagnosis_file(hard))
    for key in ("stiffness", "loop", "motion", "yield", "candidates", "spectrum"):
        assert f'<figure id="{key}">' in made
    assert "(hardening) is missing" in made
    assert "with what is proposed" in made
    assert "<script" not in made


def errs(version: Version, fitted: float, left_out: float) -> Version:
    """The version with so many times its error of the force, where it was fitted and on the last earthquake."""
    forces = tuple(
        replace(one, misfit=replace(one.misfit, error=one.misfit.error * factor**2))
        for one in version.errors.forces
        for factor in (left_out if one.observation.name == "event 3" else fitted,)
    )
    return replace(version, errors=replace(version.errors, forces=forces))


@settings(max_examples=200, deadline=None)
@given(after=st.floats(-3, 3), elsewhere=st.floats(-3, 3), others=st.floats(-3, 3), bic=st.floats(-1e4, 1e4))
def test_sentences_agree_with_the_numbers(
    diagnosed: DiagnosisResult, after: float, elsewhere: float, others: float, bic: float
) -> None:
    """For an error of any size with the effect; 10 to the power of what is given."""
    hard = diagnosed
    first = replace(hard.candidates[0], after=replace(hard.before, error=hard.before.error * 100**others))
    step = replace(hard.stages[0].step, chosen=replace(hard.stages[0].step.chosen, delta_bic=bic))
    found = replace(
        hard,
        versions=(*hard.versions[:2], errs(hard.versions[1], 10**after, 10**elsewhere)),
        stages=(replace(hard.stages[0], step=step),),
        candidates=(first, *hard.candidates[1:]),
    )
    for diagnosis in (found, replace(found, diagnosis=replace(found.diagnosis, outcome=Outcome.UNKNOWN))):
        printed = diagnosis.text
        text = " ".join(printed)
        assert all(sentence[0] == sentence[0].upper() for sentence in printed)
        for was, now in re.findall(r"falls from ([\d.,]+) kN to ([\d.,]+) kN", text):
            assert float(now.replace(",", "")) < float(was.replace(",", ""))
        for was, now in re.findall(r"raises the error of the force from (\S+) kN to (\S+) kN", text):
            assert float(now.replace(",", "")) > float(was.replace(",", ""))
    is_worth_it, helps_elsewhere = 10**after < LOWERS, 10**elsewhere < LOWERS
    printed = found.text
    assert any(" is missing." in sentence for sentence in printed) == is_worth_it
    assert any("but not where it was fitted" in one for one in printed) == (not is_worth_it and helps_elsewhere)
    assert any("does not lower the error enough to be kept" in one for one in printed) == (
        not is_worth_it and not helps_elsewhere
    )
    assert "(hardening) comes nearest and does not explain it." in text
    nameless = replace(found.diagnosis, outcome=Outcome.UNKNOWN, steps=())
    nearest = " ".join(replace(found, diagnosis=nameless, stages=()).text)
    assert ("The nearest known effect is Hardening" in nearest) == (10**others < LOWERS and not first.implausible)


@pytest.mark.parametrize(
    ("fitted", "left_out", "is_kept"), [(0.9, 1.2, True), (1.04, 0.9, True), (1.04, 0.99, False), (0.99, 0.99, False)]
)
def test_an_effect_is_kept_that_lowers_the_error_where_it_was_fitted_or_elsewhere(
    hard: Work[DiagnosisResult], fitted: float, left_out: float, *, is_kept: bool
) -> None:
    before = hard.result.versions[1]
    assert lowers(before, errs(before, fitted, left_out), hard.result.earthquakes) == is_kept


def test_something_unknown_has_no_name_but_what_is_nearest_and_how_much_is_unexplained(
    hard: Work[DiagnosisResult],
) -> None:
    """Hardening leaves 60 % of the excess error where it was fitted, and 80 % on the held-out earthquake."""
    found, before = hard.result, hard.result.diagnosis.ratios_before
    out = before.held_out
    assert out is not None
    left = [float(np.sqrt(1 + share * (one**2 - 1))) for share, one in ((0.6, before.fitted), (0.8, out))]
    after = NoiseRatios(*left)
    (step,) = found.diagnosis.steps
    step = replace(step, worth=worth(before, after))
    unknown = replace(found.diagnosis, outcome=Outcome.UNKNOWN, steps=(step,), ratios_after=after)
    done = replace(hard, result=replace(found, diagnosis=unknown))
    document = through_json(as_json(documents.diagnosis(done)))
    assert (document["outcome"], document["set"], document["steps"]) == ("unknown", [], [])
    assert document["resembles"] == ["hardening"]
    assert document["unexplained"]["of_excess"] == pytest.approx(0.6)
    assert document["unexplained"]["of_excess_held_out"] == pytest.approx(0.8)
    for made in (page(report.diagnosis_file(done)), document["explanation"]):
        assert "is missing." not in made
        assert "(hardening) comes nearest and does not explain it." in made
        assert "takes 40.0 % of the excess error where it was fitted and 20.0 % on held-out earthquakes" in made
        assert "60.0 % is unexplained where it was fitted and 80.0 % on held-out earthquakes" in made


def test_an_impossible_effect_is_never_the_nearest_nor_stated_to_help(diagnosed: DiagnosisResult) -> None:
    hard = diagnosed
    first = replace(hard.candidates[0], implausible="it has no strength left", delta_bic=-1e6)
    unknown = replace(hard.diagnosis, outcome=Outcome.UNKNOWN, steps=())
    printed = " ".join(replace(hard, diagnosis=unknown, stages=(), candidates=(first, *hard.candidates[1:])).text)
    assert "Not proposed because it is doubtful: Hardening" in printed
    assert "The nearest known effect is Hardening" not in printed
    assert "With hardening" not in printed


@pytest.mark.parametrize(("ratios", "is_mentioned"), [(1.9, True), (2.1, False)])
def test_a_doubtful_effect_is_mentioned_only_if_it_leaves_little_more_than_the_best(
    diagnosed: DiagnosisResult, ratios: float, *, is_mentioned: bool
) -> None:
    """Twice what hardening leaves is too much; the model without it leaves more than that."""
    best, other = (replace(one, delta_bic=-1e6) for one in diagnosed.candidates[:2])
    left = diagnosed.diagnosis.ratios_before.fitted / 3
    doubtful = replace(other, implausible="its law is doubtful", noise_ratio=ratios * left)
    printed = " ".join(replace(diagnosed, candidates=(replace(best, noise_ratio=left), doubtful)).text)
    assert ("; its law is doubtful." in printed) == is_mentioned


def test_an_effect_that_could_not_be_judged_is_named_with_its_reason(hard: Work[DiagnosisResult]) -> None:
    diverging = (Dropped("moat", "its force grew beyond all bounds"),)
    found = replace(hard, result=replace(hard.result, diverging=diverging))
    assert found.result.text[-1].endswith("(moat) could not be checked: its force grew beyond all bounds.")
    document = through_json(as_json(documents.diagnosis(found)))
    assert document["dropped"] == [{"effect": "moat", "reason": "its force grew beyond all bounds"}]
    assert "(moat) could not be checked" in page(report.diagnosis_file(found))


def test_a_law_that_was_not_tried_is_named_with_the_reason() -> None:
    """A relief damper with a brace contains one without, and hardening explains the records."""
    seen = records_from_observations(observations(HARD, 0.02, 1))
    found = diagnose(GIVEN, "given.toml", seen, silent, ("hardening", "braced_relief"))
    document = through_json(as_json(documents.diagnosis(found)))
    assert [one["effect"] for one in document["candidates"]] == ["hardening"]
    assert document["untried"] == ["braced_relief"]
    assert found.result.text[-1].startswith("Not tried, because the records are explained without them: ")
    assert found.result.text[-1].endswith("(braced_relief).")


def test_nothing_is_missing_where_nothing_is() -> None:
    found = diagnose(GIVEN, "given.toml", records_from_observations(observations(BOUC_WEN, 0.02, 1)), silent, OFFERED)
    assert found.result.text[0].startswith("No known effect is missing: the error of the force is ")
    assert through_json(as_json(documents.diagnosis(found)))["steps"] == []
    assert "with what is proposed" not in page(report.diagnosis_file(found))


def test_values_that_are_off_want_a_fit() -> None:
    found = diagnose(FAR, "far.toml", records_from_observations(observations(BOUC_WEN, 0.02, 5)), silent, OFFERED)
    assert found.result.text[0] == "No known effect is missing, but the values are wrong: fit the model."


@pytest.fixture(scope="module")
def improved() -> Work[ImprovementResult]:
    seen = observations(HARD, 0.01, 7, PEAKS)
    return improve(FAR, "far.toml", records_from_observations(seen, {"event 3"}), silent, OFFERED)


def test_an_improved_model_has_what_was_missing_and_can_be_read_back(improved: Work[ImprovementResult]) -> None:
    assert improved.result.added == ("hardening",)
    assert [version.name for version in improved.result.versions] == ["as given", "refitted", "with hardening"]
    again = read(written(improved.model))
    assert again == improved.model
    assert (again.parent, again.fitted_to) == ("far.toml", ("event 0", "event 1", "event 2"))
    assert again.isolator.effects["elastic"]["k_b"] == pytest.approx(475e6, rel=0.02)
    assert "Improvement ended: no further effect is needed." in improved.result.text
    assert through_json(as_json(documents.improvement(improved)))["taken"] == ["hardening"]


def test_where_no_known_effect_explains_it_earthquakes_are_left_out_in_turn() -> None:
    """The law is none of those offered: what describes it must predict, and the strongest earthquake is told apart."""
    unknown = {"hysteresis_spectrum": {"F_s": 1e6}, "strain_softening": {}, "mullins": {}}
    seen = observations(Isolator({**BOUC_WEN.effects, **unknown}), 0.01, 3, (0.05, 0.12, 0.06), 21.0)
    offered = ("hardening", "recent_softening", "maxwell")
    found = improve(GIVEN, "given.toml", records_from_observations(seen, set()), silent, offered)
    document = through_json(as_json(documents.improvement(found)))
    first, *_, last = document["left_out"]
    assert (first["effect"], last["effect"], last["added"]) == (None, document["taken"][-1], True)
    assert set(last["errors"]) == {"event 0", "event 1", "event 2"}
    assert last["error"] < 0.85 * first["error"]
    assert [version.name for version in found.result.versions] == ["as given", "refitted", "improved"]
    text = " ".join(found.result.text)
    assert [one["fitted_to"] for one in last["stronger"]] == [["event 0", "event 2"]]
    assert last["error_in_stronger"] < 0.95 * first["error_in_stronger"]
    assert "in those of up to 120 mm (event 1)" in text
    assert "At 2 times the range fitted, 240 mm, a prediction of the force may err by" in text
    assert [one["displacement"] for one in document["beyond"]] == [pytest.approx(0.18), pytest.approx(0.24)]
    assert "Beyond 120 mm the model's laws are extrapolated" in text
    console = Console(width=160, record=True, file=StringIO())
    console.print(printed(report.change(found)))
    assert "Error of the force in earthquakes left out in turn" in console.export_text()
    whole = report.improvement_file(found, work(found.result.rounds[0], found.given, "given.toml"))
    assert next(part.key for part in whole.parts if isinstance(part, Figure)) == "left_out"
    html = page(whole)
    assert html.index("Improvement: ") < html.index("Error in earthquakes left out") < html.index("First diagnosis")


def test_an_effect_that_no_one_requested_is_added_and_that_is_stated() -> None:
    seen = records_from_observations(observations(BOUC_WEN, 0.02, 2, PEAKS), {"event 3"})
    found = add("hardening", GIVEN, "given.toml", seen, silent)
    text = " ".join(found.result.text)
    assert "The records do not support it" in text
    assert "The error falls only for the fitted earthquakes" in text
    document = through_json(as_json(documents.extension(found)))
    assert document["added"]["effect"] == "hardening"
    assert set(document["model"]["effects"]) == {*BOUC_WEN.effects, "hardening"}


SLOW = BuildingFault(Cause.SENSOR, "gain", "XX.PAPER.01.HYX", -0.09, 0.005, "reads 9.0 ± 0.5 % too little")
SOFT = BuildingFault(Cause.SUPERSTRUCTURE, "storey", "3F", -0.3, 0.03, "is 30 % softer than described")


def test_what_is_wrong_before_the_layer_is_the_outcome_and_comes_first(hard: Work[DiagnosisResult]) -> None:
    suspected = replace(hard, result=replace(hard.result, faults=(SOFT, SLOW)))
    document = through_json(as_json(documents.diagnosis(suspected)))
    assert document["outcome"] == "sensor_fault"
    assert [finding["kind"] for finding in document["findings"]] == ["storey", "gain"]
    assert document["findings"][1]["std"] == 0.005
    assert suspected.result.text[1].startswith("The sensor XX.PAPER.01.HYX: reads 9.0 ± 0.5 % too little.")
    assert "(hardening) is missing" in document["explanation"]
    assert replace(hard.result, faults=(SOFT,)).outcome == "superstructure"


def test_without_a_usable_record_the_sensors_are_the_diagnosis() -> None:
    document = through_json(as_json(documents.diagnosis_without_records("PAPER", (SLOW,), ("2021-03-04: refused",))))
    assert (document["outcome"], document["candidates"], document["unused"]) == (
        "sensor_fault",
        [],
        ["2021-03-04: refused"],
    )
    assert "Correct this first" in document["explanation"]
