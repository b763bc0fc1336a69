"""The library's front door: a notebook goes from arrays to a diagnosis, and every result prints a report."""

import pickle
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from building_models import paper, records as sensors, segments
from hypothesis import given, settings, strategies as st
from paper_records import START

import core
from core.arrays import Vector
from core.effects import EFFECTS, also
from core.estimates import ForceHistory, MotionHistory
from core.paper import BUILDING, ISOLATOR, RATE
from core.signals.conditioning import band_passed

DOCUMENT = Path(__file__).resolve().parents[2] / "docs" / "models" / "library.md"
MASSES = np.append(BUILDING.base_mass, BUILDING.floor_mass)
COUNT = 5000
EFFECTS_TRIED = ("hardening", "friction", "moat")


def ground(rng: np.random.Generator) -> Vector:
    shape = np.zeros(COUNT)
    shape[1000:3500] = np.sin(np.pi * np.arange(2500) / 2500)
    return band_passed(shape * rng.standard_normal(COUNT) * 3, RATE, (0.1, 10.0))


def arrays(seed: int = 1) -> dict[str, Any]:
    """Sensors of the paper's building on rubber that hardens."""
    rng = np.random.default_rng(seed)
    truth = core.Isolator({**ISOLATOR.effects, "hardening": {"k3": 2e11, "k5": 0.0}})
    moving = ground(rng)
    response = core.simulate(BUILDING, truth, moving, RATE)

    def noisy(samples: Any, std: float) -> Any:  # noqa: ANN401  (n,) or (k, n)
        return samples + std * rng.standard_normal(samples.shape)

    return {
        "base": noisy(response.base_acceleration, 1e-3),
        "floors": noisy(response.floor_acceleration[[2, 6]], 1e-3),
        "ground": noisy(moving, 1e-3),
        "displacement": noisy(response.isolator_displacement, 1e-5),
    }


def force_of(one: dict[str, Any]) -> ForceHistory:
    return core.restoring_force(RATE, base=one["base"], floors=one["floors"], measured=[2, 6], masses=MASSES)


def motion_of(one: dict[str, Any]) -> MotionHistory:
    return core.layer_motion(RATE, displacement=one["displacement"], base=one["base"], ground=one["ground"])


@pytest.fixture(scope="module")
def results() -> dict[str, Any]:
    """The example of the review, with few effects to try."""
    one = arrays()
    force, motion = force_of(one), motion_of(one)
    cycles = core.equivalents(force, motion, rubber_height=0.2)
    quake = core.Observation.of(force, motion, ground=one["ground"], name="the first")
    model = core.Isolator({"elastic": {"k_b": 4e8}, "viscous": {"c_b": 5e6}, "bouc_wen": {"F_y": 1e6}})
    fit = core.fit(model, [quake])
    comparison = core.compare(fit.model, [quake])
    result = core.diagnose(fit.model, [quake], effects=EFFECTS_TRIED)
    described = paper()
    analysed = [core.analyse(segments(sensors(seed)), described) for seed in (1, 2)]
    series = core.drift_series(analysed)
    with also({}):  # the effect of the sketch is not left to other tests
        sketch = core.sketch(fit.model, [quake], name="lacking")
    return {
        "force": force,
        "motion": motion,
        "cycles": cycles,
        "observation": quake,
        "model": model,
        "fit": fit,
        "comparison": comparison,
        "diagnosis": result,
        "extension": core.add("hardening", fit.model, [quake]),
        "improvement": core.improve(fit.model, [quake], effects=("hardening",)),
        "forecast": core.forecast(fit.model, [quake], core.GroundMotion.of("stronger", RATE, x=1.5 * one["ground"])),
        "better fit": core.fit(result.model, [quake]),
        "analysis": analysed[0],
        "earthquakes": core.Earthquakes.of([quake]),
        "response": core.simulate(BUILDING, ISOLATOR, one["ground"], RATE),
        "first model": core.first_model(described),
        "series": series["stiffness", "x"],
        "residuals": series["residual_displacement", "x"],
        "monitoring": core.monitor(series["stiffness", "x"]),
        "sketch": sketch,
    }


@pytest.mark.accuracy
def test_the_hidden_effect_is_named_and_the_next_fit_is_right(results: dict[str, Any]) -> None:
    assert [stage.effect for stage in results["diagnosis"].stages] == ["hardening"]
    assert results["improvement"].added == ("hardening",)
    fit = results["better fit"]
    for effect, name, truth in (("elastic", "k_b", 475e6), ("hardening", "k3", 2e11)):
        assert fit.model.effects[effect][name] == pytest.approx(truth, abs=5 * fit.std[effect][name])
    assert results["extension"].model.effects["hardening"]["k3"] == pytest.approx(2e11, rel=0.01)


def test_arrays_give_what_the_whole_analysis_gives() -> None:
    measured = sensors(2)
    analysis = core.analyse(segments(measured), paper()).directions["x"]
    moving, base, fourth, roof, displacement = measured.values()
    given = {"base": base, "floors": np.array([fourth, roof]), "ground": moving, "displacement": displacement}
    force, motion = force_of(given), motion_of(given)
    assert np.linalg.norm(force.force - analysis.restoring_force.force) < 1e-6 * np.linalg.norm(force.force)
    assert analysis.motion is not None
    assert np.linalg.norm(motion.displacement - analysis.motion.displacement) < 1e-3 * np.linalg.norm(displacement)
    assert len(core.equivalents(force, motion)) == len(analysis.equivalent)


def test_a_fast_record_is_resampled_as_the_service_does_it() -> None:
    one = arrays()
    slow = force_of(one)
    fast = {name: np.repeat(np.atleast_2d(rows), 2, axis=1) for name, rows in one.items()}
    kept = {name: band_passed(rows, 2 * RATE, (0.05, 40.0)) for name, rows in fast.items()}
    force = core.restoring_force(2 * RATE, base=kept["base"][0], floors=kept["floors"], measured=[2, 6], masses=MASSES)
    assert (force.rate, force.force.size) == (slow.rate, slow.force.size)
    motion = core.layer_motion(2 * RATE, displacement=kept["displacement"][0])
    quake = core.Observation.of(force, motion, ground=kept["ground"][0])
    assert quake.ground_acceleration is not None
    assert quake.ground_acceleration.size == force.force.size


def test_every_result_prints_values_with_units(results: dict[str, Any]) -> None:
    for name, result in results.items():
        text = str(result)
        assert re.search(r"\d ?(mm|kN|kN/mm|%)|kN/mm|\d more events", text), name
        assert not re.search(r"\bNone\b|\bnan\b|\binf\b|<core|array\(", text), (name, text)
        assert max(map(len, text.splitlines())) < 200, name
    assert re.search(
        r"displacement of the isolators +\d+(\.\d+)? mm +\d+(\.\d+)? to \d+(\.\d+)? mm",
        str(results["forecast"]),
    )
    for name in ("force", "motion", "cycles", "fit", "diagnosis", "extension", "improvement"):
        assert "±" in str(results[name]), name


def test_every_result_is_pickled(results: dict[str, Any]) -> None:
    for name, result in results.items():
        again = pickle.loads(pickle.dumps(result))
        assert type(again) is type(result), name
        assert str(again) == str(result), name


def test_another_process_reads_a_sketch(results: dict[str, Any], tmp_path: Path) -> None:
    """Its proposal is an effect that only the process of the sketch knows."""
    assert results["sketch"].proposal is not None
    file = tmp_path / "sketch.pickle"
    file.write_bytes(pickle.dumps(results["sketch"]))
    read = f"import pickle; print(pickle.load(open({str(file)!r}, 'rb')))"
    done = subprocess.run([sys.executable, "-c", read], capture_output=True, text=True, check=True)
    assert done.stdout == f"{results['sketch']}\n"


@settings(max_examples=50, deadline=None)
@given(st.sets(st.sampled_from(sorted(EFFECTS)), min_size=1, max_size=5))
def test_a_model_takes_the_usual_values_and_prints_them(names: set[str]) -> None:
    model = core.Isolator({name: {} for name in names})
    for name in names:
        assert model.effects[name] == {one.name: one.prior.median for one in EFFECTS[name].parameters}
        assert name in str(model)
    with pytest.raises(core.ModelError, match="takes values for"):
        core.Isolator.of_all_values({name: {} for name in names})


def test_a_held_out_earthquake_tests_the_fit(results: dict[str, Any]) -> None:
    one = arrays(2)
    second = core.Observation.of(
        force_of(one), motion_of(one), ground=one["ground"], name="the second", start=START, temperature=15.0
    )
    fit = core.fit(results["diagnosis"].model, [results["observation"], second], hold_out=["the second"])
    assert fit.earthquakes.fitted_names == ("the first",)
    assert "on held-out earthquakes" in " ".join(fit.text)
    with pytest.raises(core.RecordError, match="no earthquake is called the third; there are the first, the second"):
        core.compare(fit.model, core.Earthquakes.of([results["observation"], second], ["the third"]))
    with pytest.raises(core.RecordError, match="same name"):
        core.compare(fit.model, [second, second])


@pytest.mark.parametrize(
    ("changed", "error", "message"),
    [
        ({"base": np.zeros((2, 50))}, core.RecordError, r"base: one row of numbers .* shape \(2, 50\)"),
        ({"floors": np.zeros((2, 50))}, core.RecordError, "differ in length"),
        ({"base": np.full(COUNT, np.nan)}, core.RecordError, "base: 5000 of 5000 samples are gaps"),
        ({"measured": [2]}, core.RecordError, "2 rows are given, but `measured` names 1"),
        ({"measured": [6, 2]}, core.ModelError, "rising indices from 0 to 6"),
        ({"measured": [2, 7]}, core.ModelError, "rising indices from 0 to 6"),
        ({"masses": [1e6]}, core.ModelError, "one mass only"),
        ({"masses": -MASSES}, core.ModelError, "needs a mass above 0 kg"),
        ({"stiffness": [1e9]}, core.ModelError, "7 storeys are needed for 8 masses, got 1"),
        ({"band": (0.1, 60.0)}, core.RecordError, "does not fit a rate of 100 Hz"),
        ({"estimator": "magic"}, core.ModelError, "no estimator is called 'magic'"),
        ({"rate": 0.0}, core.RecordError, "sampling rate must be positive"),
    ],
)
def test_what_cannot_be_used_is_refused_in_words(
    changed: dict[str, Any], error: type[core.CoreError], message: str
) -> None:
    one = arrays()
    requested = {"rate": RATE, "base": one["base"], "floors": one["floors"], "measured": [2, 6], "masses": MASSES}
    with pytest.raises(error, match=message):
        core.restoring_force(**{**requested, **changed})


def test_another_unit_is_noticed() -> None:
    one = arrays()
    with pytest.raises(core.RecordError, match=r"is it in gal \(0.01 m/s²\)"):
        force_of({**one, "base": 100 * one["base"] / np.abs(one["base"]).max() * 3})
    with pytest.raises(core.RecordError, match="is it in mm"):
        motion_of({**one, "displacement": 1e3 * one["displacement"]})


def test_force_and_motion_must_be_of_the_same_samples() -> None:
    one = arrays()
    force = force_of(one)
    motion = core.layer_motion(RATE, displacement=one["displacement"][:-100])
    with pytest.raises(core.RecordError, match="4900 samples at 100 Hz"):
        core.equivalents(force, motion)
    with pytest.raises(core.RecordError, match="needed for the motion"):
        core.layer_motion(RATE, base=one["base"])
    with pytest.raises(core.RecordError, match="ground: 5000 samples are needed"):
        core.Observation.of(force, motion_of(one), ground=one["ground"][:-1])


def test_a_workbench_without_earthquakes_says_so(results: dict[str, Any]) -> None:
    for operation in (core.fit, core.compare, core.diagnose, core.improve):
        with pytest.raises(core.RecordError):
            operation(results["model"], [])
    quake, model = results["observation"], results["model"]
    with pytest.raises(core.RecordError, match="held out"):
        core.diagnose(model, [quake], hold_out=["the first"])
    with pytest.raises(core.ModelError, match="no effect 'magic'"):
        core.add("magic", model, [quake])
    with pytest.raises(core.ModelError, match="has elastic already"):
        core.add("elastic", model, [quake])


def test_every_name_is_there_and_documented() -> None:
    documented = set(re.findall(r"`(\w+)`", DOCUMENT.read_text("utf-8").partition("## Names")[2]))
    assert documented == set(core.__all__)
    assert set(core.__all__) <= set(dir(core))
    assert all(getattr(core, name).__doc__ for name in core.__all__ if name != "EFFECTS")
    with pytest.raises(AttributeError, match="no attribute 'magic'"):
        _ = core.magic


def test_no_name_is_that_of_a_room() -> None:
    """The import of a submodule would take the name's place."""
    rooms = {one.stem for one in Path(core.__path__[0]).iterdir()}
    assert not rooms & set(core.__all__)


def test_the_import_loads_nothing() -> None:
    code = "import sys, core; print({'numpy', 'scipy', 'numba'} & sys.modules.keys())"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "set()"
