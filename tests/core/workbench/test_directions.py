"""Both directions are diagnosed, each by itself, and an effect that acts in one of them only is said to."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import pytest
from building_models import paper, records, segments
from paper_records import START
from records_from_observations import records_from_observations
from synthetic_observations import BOUC_WEN, observations

from core.analysis import AnalysisSettings, analyse
from core.errors import RecordError
from core.fitting.observation import Observation
from core.model.isolator import Isolator
from core.paper import ISOLATOR
from core.record import Direction
from core.workbench.diagnosing import diagnose
from core.workbench.diagnosis_result import DiagnosisResult
from core.workbench.earthquakes import Earthquakes, Recording, analysed, joined

OFFERED = ("friction", "hardening", "power_viscous")
HARD = Isolator({**BOUC_WEN.effects, "hardening": {"k3": 2e10, "k5": 0.0}})
STATIC = AnalysisSettings(estimator="cms")
PEAKS = (0.010, 0.080, 0.040)


def along(direction: Direction, truth: Isolator, seed: int, peaks: Sequence[float] = PEAKS) -> list[Observation]:
    return [replace(one, direction=direction) for one in observations(truth, 0.02, seed, peaks)]


def seen(x: Isolator, y: Isolator, peaks_y: Sequence[float] = PEAKS) -> Earthquakes:
    return records_from_observations([*along("x", x, 1), *along("y", y, 2, peaks_y)])


@pytest.fixture(scope="module")
def one_sided() -> DiagnosisResult:
    """A model of both directions; the layer hardens along y only."""
    return diagnose(BOUC_WEN, seen(BOUC_WEN, HARD), effects=OFFERED)


@pytest.mark.accuracy
def test_each_direction_has_its_own_answer(one_sided: DiagnosisResult) -> None:
    named = {one.direction: [step.chosen.effect for step in one.diagnosis.named] for one in one_sided.directions}
    assert named == {"x": [], "y": ["hardening"]}
    assert [one.diagnosis.outcome.value for one in one_sided.directions][1] == "effect"


def test_the_text_says_in_which_direction_it_acts_and_why_not_in_the_other(one_sided: DiagnosisResult) -> None:
    text = " ".join(one_sided.text)
    assert "In direction y only: " in text
    assert "(hardening). With the same values in direction x, the error would rise from " in text
    assert "In direction x only" not in text


@pytest.mark.accuracy
def test_weak_records_of_the_other_direction_do_not_exclude_it() -> None:
    found = diagnose(BOUC_WEN, seen(HARD, BOUC_WEN, (0.004, 0.006, 0.005)), effects=OFFERED)
    text = " ".join(found.text)
    assert "In direction x only: " in text
    assert "The records of direction y, up to 6 mm, neither show nor exclude it." in text


def test_an_effect_of_both_directions_is_named_once() -> None:
    found = diagnose(BOUC_WEN, seen(HARD, HARD), effects=OFFERED)
    assert [one.effect for one in found.stages] == ["hardening"]
    assert [[step.chosen.effect for step in one.diagnosis.named] for one in found.directions] == [["hardening"]] * 2
    assert "only: " not in " ".join(found.text)


def test_one_direction_is_looked_at_where_only_that_is_wanted() -> None:
    assert diagnose(BOUC_WEN, seen(BOUC_WEN, HARD), effects=OFFERED, directions=["x"]).directions == ()


def test_a_direction_that_no_record_has_is_refused_in_words() -> None:
    alone = records_from_observations(along("x", BOUC_WEN, 1))
    with pytest.raises(RecordError, match="no earthquake has force and motion of the layer in direction y: choose x"):
        diagnose(BOUC_WEN, alone, effects=OFFERED, directions=["y"])
    assert diagnose(BOUC_WEN, alone, effects=("hardening",), directions=["x", "y"]).directions == ()


def test_the_progress_of_a_diagnosis_never_goes_back_and_names_its_steps() -> None:
    reports = list[tuple[str, int, int]]()
    diagnose(BOUC_WEN, seen(HARD, HARD), effects=OFFERED, progress=lambda *one: reports.append(one))
    shares = [done / of for _, done, of in reports]
    assert shares == sorted(shares)
    assert (shares[0] < 0.2, shares[-1]) == (True, 1.0)
    reached = {doing: done / of for doing, done, of in reports}
    steps = list(reached)
    assert steps[0] == "trying every effect"
    assert steps[1].startswith("step 1: ")
    searched = next(number for number, (doing, *_) in enumerate(reports) if doing == "trying them on every earthquake")
    assert reached[steps[0]] < shares[searched - 1], "the second ranking moves the bar on"
    assert steps[-3:] == ["diagnosing direction x", "diagnosing direction y", "diagnosed"]


def test_a_model_of_one_direction_is_diagnosed_in_the_other_from_the_same_records() -> None:
    """The analyses know both directions; the observations of the model one."""
    axes = {"HNX": "HNY", "HYX": "HYY"}
    other = [replace(one, id=_turned(one.id, axes), direction="y") for one in paper().channels]
    building = replace(paper(), channels=(*paper().channels, *other))
    along_x = records(1)
    samples = {**along_x, **{_turned(name, axes): values for name, values in along_x.items()}}
    recording = Recording(tuple(segments(samples)), building, STATIC, ("x",), START)
    analysis = analyse(recording.segments, building, STATIC)
    made = joined([analysed("event", analysis, recording)], building, STATIC.band, reference=START)
    assert made.directions == ("x",)
    found = diagnose(ISOLATOR, made, effects=())
    assert [one.direction for one in found.directions] == ["x", "y"]
    assert found.directions[0].diagnosis is found.diagnosis
    assert {one.direction for one in found.directions[1].earthquakes.observations} == {"y"}


def _turned(name: str, axes: Mapping[str, str]) -> str:
    return name[:-3] + axes[name[-3:]]
