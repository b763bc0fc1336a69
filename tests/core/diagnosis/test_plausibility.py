"""Objections to implausible effects, and none to effects that are present."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from synthetic_observations import BOUC_WEN, RATE, motion, observations

from core.building import FixedBaseModes
from core.diagnosis.effect_search import without_needless
from core.diagnosis.plausibility import implausible, objection
from core.diagnosis.ranking import ScoredCandidate
from core.estimators.result import RestoringForce
from core.fitting.data import FitData
from core.fitting.fit import Fit, at_values, fitted
from core.fitting.observation import Observation
from core.model.isolator import Conditions, Isolator


@cache
def seen() -> list[Observation]:
    return observations(BOUC_WEN, 0.01, 3)


def fit(model: Isolator) -> Fit:
    return fitted(FitData.by_noise(seen()), model)


def test_nothing_speaks_against_what_is_there() -> None:
    assert implausible("bouc_wen", fit(BOUC_WEN), seen()) is None


def test_an_effect_whose_opposite_is_requested_has_no_strength() -> None:
    """The records of a layer that softens: a spring less stiff with displacement."""
    softer = [
        replace(one, layer=replace(one.layer, force=one.layer.force - 2e10 * one.layer.displacement**3))
        for one in seen()
    ]
    model = Isolator({**BOUC_WEN.effects, "hardening": {"k3": 1e10, "k5": 1e12}})
    fit = fitted(FitData.by_noise(softer), model)
    assert implausible("hardening", fit, softer) == "it has no strength left: the records support its opposite"


def test_one_of_two_strengths_may_be_nothing() -> None:
    model = Isolator({**BOUC_WEN.effects, "hardening": {"k3": 1e10, "k5": 0.0}})
    assert implausible("hardening", replace(fit(BOUC_WEN), model=model), seen()) is None


def test_what_no_record_determines_is_stated() -> None:
    wall = {"gap": 0.3, "gap_back": 0.3, "wall": 1e8, "wall_back": 1e8}
    result = fit(Isolator({**BOUC_WEN.effects, "moat": wall}))
    reason = implausible("moat", result, seen())
    assert reason is not None
    assert "strength" in reason or "do not determine" in reason


def test_a_layer_does_not_feed_the_motion() -> None:
    against = Isolator({"elastic": {"k_b": 475e6}, "relief": {"relieved": 2e7, "v_r": 0.01}})
    result = replace(at_values(FitData.by_noise(seen()), BOUC_WEN), model=against)
    reason = implausible("relief", result, seen())
    assert reason is not None
    assert reason.startswith("the layer would feed energy into the motion in the earthquake of event")
    against = objection("relief", result, seen())
    assert against is not None
    assert against.is_impossible


MODES = FixedBaseModes(2 * np.pi * np.array([1.1, 3.0]), np.array([0.02, 0.03]), np.eye(2))
SWINGS = {
    "as the slab": ({"mass": 2e6, "frequency": 18.0, "damping": 0.6}, "it moves with the slab"),
    "as the slab and a mode together": ({"mass": 2e6, "frequency": 5.0, "damping": 0.1}, "it moves with the slab"),
    "as a mode": ({"mass": 2e4, "frequency": 1.102, "damping": 0.021}, "it swings as mode 1 of the superstructure"),
    "so strongly that the mode's frequency is another": ({"mass": 2e6, "frequency": 1.102, "damping": 0.021}, None),
    "slower than a mode": ({"mass": 2e6, "frequency": 1.0, "damping": 0.02}, None),
    "far from a mode": ({"mass": 2e6, "frequency": 2.0, "damping": 0.05}, None),
}


def shaken(modes: FixedBaseModes) -> list[Observation]:
    """Records of a building whose superstructure was identified to have these modes."""
    rng = np.random.default_rng(1)
    return [
        replace(
            one,
            conditions=replace(one.conditions, ground=RATE * np.gradient(motion(0.05, rng)[1])),
            estimate=RestoringForce("cms", *4 * [one.layer.force], (), superstructure=modes),
        )
        for one in seen()
    ]


def with_mass(values: dict[str, float]) -> Fit:
    return replace(fit(BOUC_WEN), model=Isolator({**BOUC_WEN.effects, "tuned_mass": values}))


@pytest.mark.parametrize(("values", "reason"), SWINGS.values(), ids=SWINGS)
def test_a_mass_that_swings_as_the_building_does_is_a_wrong_mass_of_it(
    values: dict[str, float], reason: str | None
) -> None:
    against = objection("tuned_mass", with_mass(values), shaken(MODES))
    if reason is None:
        assert against is None
    else:
        assert against is not None
        assert against.is_impossible
        assert against.reason.startswith(reason)
        assert against.reason.endswith("in the building file would make the same force")


def test_modes_that_no_mass_on_a_spring_can_have_are_no_error() -> None:
    """A reversed channel at the roof led to a mode at 0.04 Hz."""
    odd = FixedBaseModes(2 * np.pi * np.array([0.04, 1.1, 50.0]), np.array([2e-4, 0.02, 1.5]), np.eye(3))
    against = objection("tuned_mass", with_mass({"mass": 2e4, "frequency": 1.102, "damping": 0.021}), shaken(odd))
    assert against is not None
    assert against.reason.startswith("it swings as mode 2 of the superstructure, at 1.1 Hz")


@pytest.mark.parametrize(("speed", "is_doubtful"), [(0.05, False), (0.2, True)])
def test_an_excess_that_hardly_fades_is_rather_friction(speed: float, is_doubtful: bool) -> None:
    values = {"excess": 3e5, "v_s": speed, "slip": 5e-4, "form": 0.0, "direct": 0.0}
    truth = Isolator({**BOUC_WEN.effects, "breakaway": values})
    fading = observations(truth, 0.01, 3)
    reason = implausible("breakaway", fitted(FitData.by_noise(fading), truth), fading)
    assert (reason is not None and reason.startswith("v_s is rather that of friction")) == is_doubtful


def test_friction_that_follows_the_load_is_doubtful_where_no_record_has_vertical_motion() -> None:
    dead = [replace(one, conditions=Conditions.usual(one.layer.force.size, RATE)) for one in seen()]
    model = Isolator({**BOUC_WEN.effects, "load_friction": {}})
    result = replace(fit(BOUC_WEN), model=model)
    assert implausible("load_friction", result, dead) == "it depends on the vertical motion, which no record has"


@pytest.mark.parametrize("value", [1e-5, 0.5])
def test_the_end_of_a_range_is_stated(value: float) -> None:
    yields = {**BOUC_WEN.effects["bouc_wen"], "D_y": value}
    result = replace(fit(BOUC_WEN), model=Isolator({**BOUC_WEN.effects, "bouc_wen": yields}))
    assert str(implausible("bouc_wen", result, seen())).startswith("D_y is at its ")


@pytest.mark.parametrize(("exponent", "is_simple"), [(1.02, True), (0.95, False)])
def test_a_law_that_may_be_a_simpler_one_is_doubtful(exponent: float, is_simple: bool) -> None:
    """An exponent known to 0.01: 1, a linear damper, lies two deviations away or five."""
    damper = {"force": 1e6, "exponent": exponent, "speed": 0.1, "give": 0.01}
    free, sure = (("braced_viscous", "exponent"),), np.array([[0.01**2]])
    around = Isolator({**BOUC_WEN.effects, "braced_viscous": damper})
    result = replace(fit(BOUC_WEN), model=around, free=free, covariance=sure, undetermined=())
    reason = "exponent may be 1, where a simpler law is sufficient (power of the damper's speed)"
    assert implausible("braced_viscous", result, seen()) == (reason if is_simple else None)


@pytest.mark.parametrize(
    ("name", "std", "is_doubtful"), [("corner", 0.0, False), ("corner", 3.0, True), ("sliding", 0.0, True)]
)
def test_a_shape_without_influence_raises_no_doubt(name: str, std: float, is_doubtful: bool) -> None:
    """As the corner of a slip that is over within a sample. A shape that other values imitate does, as a strength."""
    sliding = Isolator({**BOUC_WEN.effects, "friction": {"slip": 1e-4}})
    key = ("friction", name)
    result = replace(fit(BOUC_WEN), model=sliding, free=(key,), covariance=np.array([[std**2]]), undetermined=(key,))
    assert (implausible("friction", result, seen()) is not None) == is_doubtful


def test_what_depends_on_the_other_direction_needs_motion_there() -> None:
    warm = Isolator({**BOUC_WEN.effects, "biaxial_heating": {"loss": 0.1, "recovery": 50.0}})
    result = replace(fit(BOUC_WEN), model=warm)
    rest = np.zeros_like(seen()[0].conditions.time)
    still = [replace(one, conditions=replace(one.conditions, u_cross=rest, v_cross=rest)) for one in seen()]
    moving = [replace(one, conditions=replace(one.conditions, u_cross=rest, v_cross=rest + 0.1)) for one in seen()]
    reason = "it depends on motion in the other direction, which no record has"
    assert implausible("biaxial_heating", result, still) == reason
    assert implausible("biaxial_heating", result, moving) is None


def test_a_law_that_contains_a_simpler_one_competes_with_one_of_as_many_parameters() -> None:
    """Both have three: only second_hysteresis, of two, is simpler than sharp_hysteresis."""
    base = fit(BOUC_WEN)
    sharp, steel, simple = (
        ScoredCandidate(name, base, -100.0) for name in ("sharp_hysteresis", "steel_hysteresis", "second_hysteresis")
    )
    assert without_needless([steel, sharp]) == [steel, sharp]
    assert without_needless([steel, sharp, simple]) == [steel, simple]


@pytest.mark.parametrize(
    ("braced", "named"), [(-95.0, ["power_viscous"]), (-120.0, ["braced_viscous", "power_viscous"])]
)
def test_a_law_that_contains_a_simpler_one_is_named_only_if_it_is_decisively_better(
    braced: float, named: list[str]
) -> None:
    base = fit(BOUC_WEN)
    scored = [ScoredCandidate("braced_viscous", base, braced), ScoredCandidate("power_viscous", base, -100.0)]
    assert [one.effect for one in without_needless(scored)] == named
