"""Statements of an assessment: for random facts, and for one weakness at a time."""

from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from math import inf, nan
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from core.description import IsolationLayer
from service.buildings.description import GivenLimits
from service.verdict import texts
from service.verdict.assessment import REQUIRED, Facts, OpenAlert, Result, SignedInspection, assess
from service.verdict.checks import LEVELS, Lacking, Level, Limits, Measured, Outcome, checked, gravest
from service.verdict.shaking import NOT_COMPUTED, ShakingFacts, lacking

LACKING = Lacking(reason="No transducer.", remedy="A transducer.")
CALM = Facts(
    layer=IsolationLayer(rubber_height=0.2, design_displacement=0.4, moat_clearance=0.5),
    displacement=Measured(value=0.02, uncertainty=0.001),
    residual=Measured(value=0.0, uncertainty=0.001),
    rest_position=Measured(value=0.002, uncertainty=0.002),
    travel=Measured(value=3.0, uncertainty=0.2),
    shaking=ShakingFacts(
        intensity=Measured(value=3.0, uncertainty=0.1),
        long_period=Measured(value=0.08, uncertainty=0.01),
        floor_acceleration=Measured(value=0.5, uncertainty=0.02),
        drift=Measured(value=0.0005, uncertainty=0.0001),
    ),
    largest_earlier=0.1,
    stiffness={"x": Measured(value=-0.01, uncertainty=0.02), "y": Measured(value=0.0, uncertainty=0.02)},
    data_problems=(),
    sensor_problems=(),
    clock_problems=(),
    alerts=(),
)
"""Facts of an earthquake with nothing to weaken the statement."""
ALERT = OpenAlert(
    id=1, cause="stiffness/x", kind="deterioration", state="active", summary="8 % softer", low=-0.1, high=-0.06
)
BEYOND = replace(ALERT, id=2, cause="limits", kind="limit", exceeded=Level.INSPECT)
LIMIT_OF_TRAVEL = {
    "damper_travel": GivenLimits(watch=50.0, inspect=80.0, act=100.0, source="the maker of the dampers"),
    "damper_stroke": GivenLimits(watch=0.5, inspect=0.8, act=1.0, source="the maker of the dampers"),
}
DATA_ALERT = replace(ALERT, id=3, cause="source", kind="data", low=None, high=None, summary="a clock is wrong")
WEAKER: Mapping[str, Mapping[str, object]] = {
    "no usable record": {"unusable": "the base slab's record is missing"},
    "silent recorder": {"silence": "the server does not answer"},
    "provisional": {"provisional": "files are still coming in"},
    "no rubber height": {"layer": replace(CALM.layer, rubber_height=None)},
    "no design displacement": {"layer": replace(CALM.layer, design_displacement=None)},
    "no moat clearance": {"layer": replace(CALM.layer, moat_clearance=None)},
    "no displacement": {"displacement": LACKING},
    "not a number": {"displacement": Measured(value=nan, uncertainty=0.001)},
    "unknown uncertainty": {"displacement": Measured(value=0.02, uncertainty=None)},
    "infinite uncertainty": {"displacement": Measured(value=0.02, uncertainty=inf)},
    "uncertainty that is no number": {"displacement": Measured(value=0.02, uncertainty=nan)},
    "a direction is missing": {"displacement": Measured(value=0.02, uncertainty=0.001, doubt="y was rejected.")},
    "watch limit": {"displacement": Measured(value=0.25, uncertainty=0.001), "largest_earlier": 1.0},
    "within the uncertainty of a limit": {
        "displacement": Measured(value=0.1, uncertainty=0.05),
        "largest_earlier": 1.0,
    },
    "no residual displacement": {"residual": LACKING},
    "residual displacement": {"residual": Measured(value=-0.02, uncertainty=0.001)},
    "no rest position": {"rest_position": LACKING},
    "the rest position has moved": {"rest_position": Measured(value=-0.012, uncertainty=0.001)},
    "an offset that is not known": {"rest_position": Measured(value=0.0, uncertainty=0.001, doubt="1 is not known.")},
    "offsets whose errors add up": {"rest_position": Measured(value=0.0, uncertainty=0.011)},
    "shaking not computed": {"shaking": lacking(NOT_COMPUTED)},
    **{
        f"{name} at its watch limit": {"shaking": replace(CALM.shaking, **{name: Measured(value=v, uncertainty=0.0)})}
        for name, v in {"intensity": 3.5, "long_period": 0.15, "floor_acceleration": 2.0, "drift": 0.002}.items()
    },
    "dampers": {"layer": replace(CALM.layer, damper_stroke=0.5)},
    "dampers without a known travel": {"limits": LIMIT_OF_TRAVEL, "travel": LACKING},
    "dampers of which an earthquake is not known": {
        "limits": LIMIT_OF_TRAVEL,
        "travel": Measured(value=3.0, uncertainty=0.2, doubt="1 is not known."),
    },
    "dampers beyond the watch limit of their travel": {
        "limits": LIMIT_OF_TRAVEL,
        "travel": Measured(value=60.0, uncertainty=0.2),
    },
    "first earthquake": {"largest_earlier": None},
    "beyond history": {"largest_earlier": 0.015},
    "history that is no number": {"largest_earlier": nan},
    "no baseline": {"stiffness": {"x": LACKING, "y": Measured(value=0.0, uncertainty=0.02)}},
    "no direction at all": {"stiffness": {}},
    "softer": {"stiffness": {"x": Measured(value=-0.15, uncertainty=0.02)}},
    "data problem": {"data_problems": ("XX.A: clipped",)},
    "sensor problem": {"sensor_problems": ("XX.A: dead",)},
    "clock problem": {"clock_problems": ("XX.A: 0.2 s late",)},
    "record not screened": {"data_problems": LACKING, "sensor_problems": LACKING, "clock_problems": LACKING},
    "earlier exceedance": {"alerts": (BEYOND,)},
    "alert that began later": {"alerts": (replace(ALERT, is_later=True),)},
    **{
        f"{kind} alert, {state}": {"alerts": (replace(ALERT, kind=kind, state=state),)}
        for kind in ("deterioration", "recovery", "sensor", "model", "data", "a new kind")
        for state in ("pending", "active", "acknowledged", "on_hold", "a new state")
    },
}


def test_only_facts_without_any_weakness_are_normal() -> None:
    found = assess(CALM)
    assert found.level is Level.NORMAL
    assert {check.name for check in found.checks} == REQUIRED
    assert " ".join(texts.sentences(found)) == "Normal. This does not replace an inspection. 15 of 15 checks passed."
    assert texts.headline(found) == "normal: 15 of 15 checks passed"


@pytest.mark.parametrize("weakness", WEAKER)
def test_one_weakness_is_enough(weakness: str) -> None:
    found = assess(replace(CALM, **WEAKER[weakness]))  # type: ignore[arg-type]
    assert found.level is not Level.NORMAL
    printed = " ".join((texts.headline(found), *texts.sentences(found)))
    assert "Normal" not in printed
    assert "normal:" not in printed


numbers = st.none() | st.floats(width=32) | st.floats(0, 1)
measured = st.builds(
    Measured,
    value=st.floats(width=32) | st.floats(-0.5, 0.5),
    uncertainty=numbers,
    doubt=st.sampled_from(["", "", "y was rejected."]),
)
values = st.just(LACKING) | measured
alerts = st.builds(
    OpenAlert,
    id=st.integers(1, 9),
    cause=st.sampled_from(["stiffness/x", "stiffness", "damping/y", "gain/XX.A", "source", "model_error/x", "new"]),
    kind=st.sampled_from(["deterioration", "recovery", "sensor", "model", "data", "new"]),
    state=st.sampled_from(["pending", "active", "acknowledged", "on_hold", "new"]),
    summary=st.just("something changed"),
    low=numbers,
    high=numbers,
    exceeded=st.none() | st.sampled_from(Level),
    is_later=st.booleans(),
)
inspections = st.builds(
    SignedInspection,
    by=st.just("Jo"),
    at=st.just(datetime(2024, 1, 1, tzinfo=UTC)),
    result=st.sampled_from(Result),
    comment=st.just("seen"),
    level=st.sampled_from(Level),
    covers=st.booleans(),
)
lengths = st.none() | st.floats(0.1, 1)
found = st.lists(st.just("clipped"), max_size=1).map(tuple) | st.just(LACKING)
facts = st.builds(
    Facts,
    unusable=st.sampled_from(["", "", "no record"]),
    silence=st.sampled_from(["", "", "no answer"]),
    provisional=st.sampled_from(["", "", "files are coming in"]),
    unseen=st.sampled_from(["", "", "The earthquake of 2024-01-01 00:00 UTC has no usable record"]),
    layer=st.builds(
        IsolationLayer,
        rubber_height=lengths,
        design_displacement=lengths,
        moat_clearance=lengths,
        damper_stroke=st.none() | lengths,
    ),
    limits=st.sampled_from([{}, {"damper_travel": LIMIT_OF_TRAVEL["damper_travel"]}]),
    displacement=values,
    residual=values,
    rest_position=values,
    travel=values,
    shaking=st.builds(ShakingFacts, intensity=values, long_period=values, floor_acceleration=values, drift=values),
    largest_earlier=numbers,
    stiffness=st.dictionaries(st.sampled_from("xy"), values),
    data_problems=found,
    sensor_problems=found,
    clock_problems=found,
    alerts=st.lists(alerts, max_size=2).map(tuple),
    inspection=st.none() | inspections,
)


def is_weak(of: Facts) -> bool:
    """True if anything is open, undecided, provisional or beyond history: written without the code under test."""
    if of.unusable or of.silence or of.provisional or of.unseen or of.alerts or not of.stiffness:
        return True
    if of.data_problems or of.sensor_problems or of.clock_problems:
        return True
    layer, moved, left, rests = of.layer, of.displacement, of.residual, of.rest_position
    lengths = (layer.rubber_height, layer.design_displacement, layer.moat_clearance, of.largest_earlier)
    if any(isinstance(one, Lacking) for one in (moved, left, rests)) or any(one is None for one in lengths):
        return True
    least = min(1.0 * lengths[0], 0.33 * lengths[1], 0.5 * lengths[2], lengths[3])  # type: ignore[operator]
    surely = [(moved, abs(moved.value), least), (left, abs(left.value), 0.010), (rests, abs(rests.value), 0.010)]
    if layer.damper_stroke is not None or of.limits:  # the building has dampers
        if layer.damper_stroke is None or isinstance(of.travel, Lacking) or not of.limits:
            return True
        surely += [(moved, abs(moved.value), 0.5 * layer.damper_stroke), (of.travel, abs(of.travel.value), 50.0)]
    above = (of.shaking.intensity, of.shaking.long_period, of.shaking.floor_acceleration, of.shaking.drift)
    for one, limit in zip(above, (3.5, 0.15, 2.0, 0.002), strict=True):
        if isinstance(one, Lacking):
            return True
        surely.append((one, abs(one.value), limit))
    for change in of.stiffness.values():
        if isinstance(change, Lacking):
            return True
        surely.append((change, abs(change.value), 0.10))
    return not all(
        not one.doubt and one.uncertainty is not None and abs(one.uncertainty) + value < limit * (1 + 1e-9)
        for one, value, limit in surely
    )


@settings(max_examples=1000, derandomize=True)
@given(facts)
def test_no_path_leads_to_a_good_statement_while_anything_is_open(of: Facts) -> None:
    found = assess(of)
    printed = " ".join((texts.headline(found), *texts.sentences(found))).lower()
    if is_weak(of):
        assert found.level is not Level.NORMAL
        assert "this is not an inspection" not in printed
    assert not any(phrase in printed for phrase in ("nothing", "unusual", "all clear", "safe"))


@given(facts)
@settings(derandomize=True)
def test_more_trouble_never_makes_it_better(of: Facts) -> None:
    worse = replace(of, alerts=(*of.alerts, BEYOND), data_problems=("clipped",), clock_problems=("late",))
    assert assess(worse).level.rank >= max(assess(of).level.rank, Level.INSPECT.rank)


@given(facts)
@settings(derandomize=True)
def test_an_inspection_lowers_what_limits_led_to_alone_and_hides_nothing(of: Facts) -> None:
    found, alone = assess(of), assess(replace(of, inspection=None))
    assert found.automatic is alone.level
    assert found.checks == alone.checks
    signed = of.inspection
    if signed is None:
        assert found.level is alone.level
        return
    assert any("Inspected by Jo on 2024-01-01" in one for one in texts.opening(found))
    if signed.result is not Result.FIT or not signed.covers:
        assert found.level is gravest((alone.level, signed.least))
        return
    if found.level.rank < alone.level.rank:
        assert alone.level in (Level.ACT, Level.INSPECT)
        assert found.level.rank >= Level.WATCH.rank
        assert alone.level.rank <= signed.level.rank  # no graver than what was known when it was signed
    assert found.level.rank >= gravest((Level.NORMAL, *(one.level for one in of.alerts))).rank


@given(facts)
@settings(max_examples=300, derandomize=True)
def test_what_is_undecided_or_missing_is_not_called_fit_for_normal_use(of: Facts) -> None:
    """The inspection stands beside it, and a limit must really have been exceeded."""
    found = assess(of)
    if texts.meaning(found) == texts.INSPECTED_MEANINGS["fit"]:
        assert found.level is Level.WATCH
        assert found.of_outcome(Outcome.EXCEEDED)
    if found.level is Level.NO_DATA and of.inspection is not None and of.inspection.result is Result.FIT:
        assert not texts.reason(found).startswith("Fit for normal use")


@given(st.floats(0, 2), st.floats(0, 1))
@settings(derandomize=True)
def test_a_check_is_decided_by_the_value_with_its_uncertainty(value: float, u: float) -> None:
    check = checked("a", Measured(value=value, uncertainty=u), Limits(watch=0.5, inspect=1.0, act=1.5, source="a test"))
    passed = value + u < 0.5
    exceeded = value - u >= 0.5
    expected = Outcome.PASSED if passed else Outcome.EXCEEDED if exceeded else Outcome.UNDECIDED
    assert check.outcome is expected
    assert (check.level is Level.ACT) == (value - u >= 1.5)
    assert (check.level is Level.NORMAL) == passed


@pytest.mark.parametrize(
    ("value", "u", "level", "limit"),
    [
        (0.4, 0.05, Level.NORMAL, 0.5),
        (0.48, 0.05, Level.UNDECIDED, 0.5),
        (0.6, 0.05, Level.WATCH, 0.5),
        (0.9, 0.2, Level.UNDECIDED, 0.5),
        (1.2, 0.1, Level.INSPECT, 1.0),
        (1.4, 0.2, Level.INSPECT, 1.0),
        (1.4, 0.8, Level.INSPECT, 0.5),
        (1.6, 0.1, Level.ACT, 1.5),
    ],
)
def test_the_level_of_a_check(value: float, u: float, level: Level, limit: float) -> None:
    """An act limit within the uncertainty leads to an inspection; a lower limit so near leaves it undecided."""
    check = checked("a", Measured(value=value, uncertainty=u), Limits(watch=0.5, inspect=1.0, act=1.5, source="a test"))
    assert (check.level, check.limit) == (level, limit)


@pytest.mark.parametrize(
    ("low", "high", "level"),
    [
        (-0.10, -0.06, Level.WATCH),
        (-0.30, -0.22, Level.INSPECT),
        (0.22, 0.30, Level.INSPECT),
        (-0.22, -0.16, Level.UNDECIDED),
        (None, None, Level.UNDECIDED),
    ],
)
def test_a_change_of_stiffness_is_compared_with_the_tolerance(
    low: float | None, high: float | None, level: Level
) -> None:
    assert replace(ALERT, low=low, high=high).level is level


def test_the_gravest_comes_first_and_nothing_is_undecided() -> None:
    assert [level.value for level in LEVELS] == ["act", "inspect", "no_data", "undecided", "watch", "normal"]
    assert gravest([]) is Level.UNDECIDED
    assert gravest([Level.NORMAL, Level.NO_DATA, Level.INSPECT]) is Level.INSPECT


def test_active_alerts_come_before_those_on_hold() -> None:
    states = ("on_hold", "pending", "acknowledged", "active")
    several = tuple(replace(ALERT, id=number, state=state) for number, state in enumerate(states))
    assert [one.state for one in assess(replace(CALM, alerts=several)).alerts] == [*reversed(states)]


def test_a_strong_earthquake_names_the_limit_and_its_source() -> None:
    found = assess(replace(CALM, displacement=Measured(value=0.295, uncertainty=0.0004), largest_earlier=0.1))
    assert found.level is Level.INSPECT
    assert found.is_beyond_history
    printed = " ".join(texts.sentences(found))
    assert printed.startswith("Inspect. Have the building inspected before normal use.")
    assert "Shear strain of the isolators: 147.50 ± 0.20 %, limit 100 % (watch), Menshin's default" in printed
    assert "design_displacement is 400 mm in the building file" in printed
    assert "limit 67 % (inspect)" in printed


def test_an_undecided_check_names_what_is_needed_to_decide() -> None:
    found = assess(replace(CALM, layer=replace(CALM.layer, design_displacement=None)))
    assert found.level is Level.UNDECIDED
    assert texts.headline(found) == "undecided: 1 of 15 checks undecided"
    assert (
        "Undecided: Displacement as a share of the design displacement. The building file gives no "
        "design_displacement. Give design_displacement under [isolation] in the building file."
        in texts.sentences(found)
    )


def test_a_title_inside_a_sentence_keeps_its_abbreviations() -> None:
    assert texts.within("Storey drift over height (below 6F)") == "storey drift over height (below 6F)"
    assert texts.within("JMA instrumental intensity") == "JMA instrumental intensity"


def moved(value: float, u: float = 0.001) -> dict[str, object]:
    """The isolators moved so far, but farther in an earlier earthquake."""
    return {"displacement": Measured(value=value, uncertainty=u), "largest_earlier": 2.0}


def left(value: float, u: float = 0.001) -> dict[str, object]:
    return {"residual": Measured(value=value, uncertainty=u)}


def rests(value: float, u: float = 0.001, doubt: str = "") -> dict[str, object]:
    return {"rest_position": Measured(value=value, uncertainty=u, doubt=doubt)}


def dampers(travel: float, doubt: str = "") -> dict[str, object]:
    """Dampers of a rated stroke of 600 mm and a rated travel of 100 m, after so much of it."""
    return {
        "layer": replace(CALM.layer, damper_stroke=0.6),
        "limits": LIMIT_OF_TRAVEL,
        "travel": Measured(value=travel, uncertainty=0.05 * travel, doubt=doubt),
    }


def shaken(**values: Measured | Lacking) -> dict[str, object]:
    return {"shaking": replace(CALM.shaking, **values)}


def softer(change: float, u: float = 0.02) -> dict[str, object]:
    return {"stiffness": {"x": Measured(value=change, uncertainty=u), "y": Measured(value=0.0, uncertainty=0.02)}}


def exactly(value: float, doubt: str = "") -> Measured:
    return Measured(value=value, uncertainty=0.0, doubt=doubt)


MAKERS = {"limits": {"stiffness": GivenLimits(watch=0.1, inspect=0.31, act=None, source="the maker's range")}}
SITUATIONS: list[tuple[str, Level, dict[str, object]]] = [
    ("a small earthquake", Level.NORMAL, {}),
    ("the first earthquake", Level.UNDECIDED, {"largest_earlier": None}),
    ("no baseline yet", Level.UNDECIDED, {"stiffness": {"x": LACKING, "y": LACKING}}),
    ("files still come in", Level.UNDECIDED, {"provisional": "its files are still coming in"}),
    ("files that do not fit together", Level.UNDECIDED, {"data_problems": ("two files differ",)}),
    ("a clipped channel", Level.UNDECIDED, {"sensor_problems": ("XX.A: clipped",)}),
    ("a clock that jumps", Level.UNDECIDED, {"clock_problems": ("XX.A: the clock jumps by 0.2 s",)}),
    ("a recorder whose clock is wrong", Level.UNDECIDED, {"alerts": (replace(DATA_ALERT, cause="clock/recorder"),)}),
    ("a sensor that no longer records", Level.UNDECIDED, {"alerts": (replace(DATA_ALERT, cause="channel/XX.A"),)}),
    (
        "a clock that went wrong after the earthquake",
        Level.WATCH,
        {"alerts": (replace(DATA_ALERT, cause="clock/recorder", is_later=True),)},
    ),
    ("no transducer", Level.UNDECIDED, {"residual": LACKING}),
    (
        "the record of y is missing",
        Level.UNDECIDED,
        {"displacement": Measured(value=0.02, uncertainty=0.001, doubt="y")},
    ),
    ("an analysis of an earlier version", Level.UNDECIDED, {"shaking": lacking(NOT_COMPUTED)}),
    ("a building file without its moat", Level.UNDECIDED, {"layer": replace(CALM.layer, moat_clearance=None)}),
    ("dampers within the limits of stroke and travel", Level.NORMAL, dampers(30.0)),
    ("dampers at half of their travel", Level.WATCH, dampers(60.0)),
    ("dampers near the end of their travel", Level.INSPECT, dampers(90.0)),
    ("dampers at the end of their travel", Level.ACT, dampers(120.0)),
    ("dampers whose travel is a lower bound", Level.UNDECIDED, dampers(30.0, "1 earthquake is not known.")),
    ("dampers whose lower bound is beyond", Level.INSPECT, dampers(90.0, "1 earthquake is not known.")),
    ("a limit of the travel within its uncertainty", Level.INSPECT, dampers(98.0)),
    ("dampers without a limit of their travel", Level.UNDECIDED, {"layer": replace(CALM.layer, damper_stroke=0.6)}),
    ("no usable record", Level.NO_DATA, {"unusable": "the base slab's record is missing"}),
    ("a silent recorder", Level.NO_DATA, {"silence": "the server does not answer"}),
    ("no record while a limit is open from before", Level.INSPECT, {"unusable": "no record", "alerts": (BEYOND,)}),
    ("a third of the design displacement", Level.WATCH, moved(0.15)),
    ("two thirds of the design displacement", Level.INSPECT, moved(0.28)),
    ("the design displacement", Level.ACT, moved(0.42)),
    ("the wall of the moat", Level.ACT, moved(0.5)),
    ("the design displacement within the uncertainty", Level.INSPECT, moved(0.39, 0.02)),
    (
        "far in x, with y unknown",
        Level.INSPECT,
        moved(0.3) | {"displacement": exactly(0.3, "no y")},
    ),
    ("an offset of 15 mm", Level.WATCH, left(0.015)),
    ("an offset of 40 mm", Level.INSPECT, left(-0.04)),
    ("an offset of 60 mm", Level.ACT, left(0.06)),
    ("offsets that add up to 15 mm", Level.WATCH, rests(0.015)),
    ("offsets that add up to 40 mm", Level.INSPECT, rests(-0.04)),
    ("offsets that add up to 60 mm", Level.ACT, rests(0.06)),
    ("the offset of an earlier earthquake is not known", Level.UNDECIDED, rests(0.001, doubt="1 is not known.")),
    ("so many offsets that their errors reach the limit", Level.UNDECIDED, rests(0.005, 0.006)),
    ("intensity 3.7", Level.WATCH, shaken(intensity=exactly(3.7))),
    ("intensity 5-lower", Level.INSPECT, shaken(intensity=exactly(4.5))),
    (
        "intensity 3.9 without the vertical component",
        Level.WATCH,
        shaken(intensity=replace(exactly(3.9), uncertainty=0.22)),
    ),
    ("long-period motion of class 3", Level.INSPECT, shaken(long_period=exactly(0.6))),
    ("a drift of 1/250", Level.INSPECT, shaken(drift=exactly(1 / 250))),
    ("a drift of 1/80", Level.ACT, shaken(drift=exactly(1 / 80))),
    ("a floor with 600 gal", Level.ACT, shaken(floor_acceleration=exactly(6.0))),
    ("15 % softer", Level.WATCH, softer(-0.15)),
    ("25 % softer", Level.INSPECT, softer(-0.25)),
    ("25 % softer, within the maker's range", Level.WATCH, {**softer(-0.25), **MAKERS}),
    ("a loss that was seen before", Level.WATCH, {"alerts": (ALERT,)}),
    ("a limit that was exceeded before", Level.INSPECT, {"alerts": (BEYOND,)}),
    ("a sensor under review", Level.UNDECIDED, {"alerts": (replace(ALERT, kind="sensor", state="pending"),)}),
]


@pytest.mark.parametrize(("situation", "level", "facts"), SITUATIONS, ids=[one[0] for one in SITUATIONS])
def test_the_level_of_a_situation(situation: str, level: Level, facts: dict[str, Any]) -> None:
    assert assess(replace(CALM, **facts)).level is level


@pytest.mark.parametrize(
    ("facts", "said"),
    [
        (dampers(60.0), "a watch limit is. Inform"),
        ({"alerts": (ALERT,)}, "an alert is open. Inform"),
        ({**dampers(60.0), "alerts": (ALERT,)}, "a watch limit is, and an alert is open. Inform"),
    ],
    ids=["a limit", "an alert", "both"],
)
def test_a_verdict_to_watch_says_what_it_is_about(facts: dict[str, Any], said: str) -> None:
    assert f"No inspection limit is exceeded, but {said} the engineer." == texts.meaning(assess(replace(CALM, **facts)))
