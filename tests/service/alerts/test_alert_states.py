"""States of alerts."""

from alert_candidates import DAY, START, gain_error, softer_isolators, stopped_data

from service.alerts.candidates import AlertCandidate, alert_cause
from service.alerts.lifecycle import OpenAlert, OperatorAction, decide, is_worse

BEFORE, NOW, LATER = START - DAY, START + 10 * DAY, START + 20 * DAY


def states(
    *found: AlertCandidate, standing: tuple[OpenAlert, ...] = (), acts: tuple[OperatorAction, ...] = ()
) -> dict[str, str]:
    return {decision.cause: decision.state for decision in decide(found, standing, acts)}


def acknowledged(found: AlertCandidate) -> OperatorAction:
    return OperatorAction(alert_cause(found.cause), NOW, "Jo", "a note", ends=False, evidence=found.evidence)


def inspected(found: AlertCandidate) -> OperatorAction:
    return OperatorAction(alert_cause(found.cause), NOW, "Jo", "a note", ends=True, evidence=found.evidence)


def test_evidence_gathers_then_fires_and_is_acknowledged() -> None:
    assert states(softer_isolators(is_sure=False)) == {"stiffness": "pending"}
    assert states(softer_isolators()) == {"stiffness": "active"}
    assert states(softer_isolators(), acts=(acknowledged(softer_isolators()),)) == {"stiffness": "acknowledged"}


def test_an_inspection_answers_what_began_before_it_and_is_no_worse() -> None:
    acts = (inspected(softer_isolators(8.0)),)
    assert states(softer_isolators(8.5), acts=acts) == {}
    assert states(softer_isolators(15.0), acts=acts) == {"stiffness": "active"}
    assert states(softer_isolators(8.0, began_at=LATER), acts=acts) == {"stiffness": "active"}


def test_what_was_acknowledged_and_grew_fires_again() -> None:
    assert states(softer_isolators(15.0), acts=(acknowledged(softer_isolators(8.0)),)) == {"stiffness": "active"}


def test_deterioration_ends_by_revised_data_only() -> None:
    reported = OpenAlert("stiffness", "deterioration", was_active=True, is_revised=False)
    revised = OpenAlert("stiffness", "deterioration", was_active=True, is_revised=True)
    assert states(standing=(reported,)) == {}
    assert states(softer_isolators(is_sure=False), standing=(reported,)) == {}
    assert states(standing=(revised,)) == {"stiffness": "withdrawn"}
    assert states(softer_isolators(is_sure=False), standing=(revised,)) == {"stiffness": "pending"}


def test_what_never_was_active_is_withdrawn_and_data_resolve_by_themselves() -> None:
    pending = OpenAlert("stiffness", "deterioration", was_active=False, is_revised=False)
    source = OpenAlert("source", "data", was_active=True, is_revised=False)
    assert states(standing=(pending,)) == {"stiffness": "withdrawn"}
    assert states(standing=(source,)) == {"source": "resolved"}


def test_a_sensor_holds_back_what_is_detected_with_it_until_it_is_settled() -> None:
    assert states(softer_isolators(), gain_error()) == {"stiffness": "on_hold", gain_error().cause: "active"}
    assert states(softer_isolators(), gain_error(), acts=(inspected(gain_error()),)) == {"stiffness": "active"}
    assert states(softer_isolators()) == {"stiffness": "active"}


def test_a_sensor_holds_back_nothing_else() -> None:
    elsewhere = gain_error("XX.DEMO.01.HNY")
    assert states(softer_isolators(), elsewhere) == {"stiffness": "active", elsewhere.cause: "active"}
    assert states(softer_isolators(), gain_error(is_sure=False))["stiffness"] == "active"
    assert states(softer_isolators(), gain_error(began_at=LATER))["stiffness"] == "active"


def whole(*found: AlertCandidate, acts: tuple[OperatorAction, ...] = ()) -> AlertCandidate:
    """Text of the one alert for these candidates."""
    (decision,) = decide(found, (), acts)
    assert decision.candidate is not None
    return decision.candidate


def test_the_directions_of_a_layer_are_one_alert_with_its_parts() -> None:
    x = softer_isolators(raised_at=START + DAY, raised_event_id=2, event_ids=(1, 2))
    y = softer_isolators(7.5, cause="stiffness/y", is_sure=False, event_ids=(2, 3), summary="softer in y")
    both = softer_isolators(7.8, cause="stiffness/xy", summary="softer in both", dated="It began in May.")
    assert states(x, y, both, softer_isolators(cause="damping/y")) == {"stiffness": "active", "damping": "active"}
    found = whole(y, both, x)
    assert (found.cause, found.summary, found.raised_event_id) == ("stiffness", "softer in both", 2)
    assert found.event_ids == (1, 2, 3)
    parts = {one["subject"]: (one["state"], one["drift"]) for one in found.evidence["parts"]}
    assert parts == {"x": ("active", -0.08), "y": ("pending", -0.075), "xy": ("active", -0.078)}
    assert found.sentences[1:3] == ("It began in May.", "The isolators are 8 % softer in direction x.")


def test_a_direction_that_differs_from_the_mean_beyond_doubt_comes_first() -> None:
    found = whole(softer_isolators(16.0), softer_isolators(8.0, cause="stiffness/xy"))
    assert found.summary == "The isolators are 16 % softer in direction x"


def test_a_later_change_in_another_direction_comes_first_and_the_earlier_one_is_named() -> None:
    later = {"began_at": LATER, "changed_after": LATER - DAY, "changed_by": LATER, "raised_at": LATER + DAY}
    found = whole(softer_isolators(20.0), softer_isolators(3.0, cause="stiffness/y", raised_event_id=9, **later))
    assert found.summary == "The isolators are 3 % softer in direction x, besides an earlier change in direction x"
    assert (found.began_at, found.raised_event_id) == (LATER, 9)


def test_an_inspection_answers_every_part_that_began_before_it_and_is_no_worse() -> None:
    """An inspection covers all of a layer; a change that grows in one direction is an alert for that direction."""
    x, y = softer_isolators(8.0), softer_isolators(8.0, cause="stiffness/y")
    known = whole(x)
    acts = (OperatorAction("stiffness", NOW, "Jo", "a note", ends=True, evidence=known.evidence),)
    assert states(x, y, softer_isolators(cause="stiffness/xy"), acts=acts) == {}
    worse = whole(x, softer_isolators(15.0, cause="stiffness/y"), acts=acts)
    assert [one["subject"] for one in worse.evidence["parts"]] == ["y"]


def test_a_part_that_a_sensor_explains_is_on_hold_within_an_active_alert() -> None:
    y = softer_isolators(cause="stiffness/y", channels=("XX.DEMO.00.HNY",))
    assert states(softer_isolators(), y, gain_error()) == {"stiffness": "active", gain_error().cause: "active"}
    decision = next(one for one in decide((softer_isolators(), y, gain_error()), (), ()) if one.cause == "stiffness")
    assert decision.candidate is not None
    parts = {one["subject"]: (one["state"], one["held_by"]) for one in decision.candidate.evidence["parts"]}
    assert parts == {"x": ("on_hold", gain_error().cause), "y": ("active", None)}


def test_the_reason_for_a_hold_is_the_real_one() -> None:
    notes = {one.cause: one.note for one in decide((softer_isolators(), gain_error()), (), ())}
    assert notes["stiffness"].startswith(f"On hold: Sensor {gain_error().channels[0]} reads 8 % more")
    notes = {one.cause: one.note for one in decide((stopped_data("source"), stopped_data("record")), (), ())}
    assert notes["record"] == "On hold: The monitoring server does not answer, which explains it."


def test_without_its_source_a_building_has_no_other_alerts_of_data() -> None:
    found = (
        stopped_data("source"),
        stopped_data("record"),
        stopped_data("channel/XX.DEMO.01.HNX"),
        stopped_data("worker"),
    )
    assert states(*found) == {
        "source": "active",
        "record": "on_hold",
        "channel/XX.DEMO.01.HNX": "on_hold",
        "worker": "active",
    }


def test_worse_is_beyond_doubt_and_away_from_none() -> None:
    assert is_worse({"low": -0.09, "high": -0.07}, {"low": -0.12, "high": -0.10})
    assert not is_worse({"low": -0.09, "high": -0.07}, {"low": -0.12, "high": -0.08})
    assert not is_worse({"low": -0.09, "high": -0.07}, {"low": -0.03, "high": -0.01})
    assert is_worse({"low": 0.07, "high": 0.09}, {"low": 0.10, "high": 0.12})
    assert not is_worse({}, {"low": -0.12, "high": -0.10})
