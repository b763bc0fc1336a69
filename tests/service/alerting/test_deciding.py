"""Which state an alert should be in."""

from findings import DAY, START, gain, softer, stopped

from service.alerting.acts import Act, is_worse
from service.alerting.deciding import Standing, decide
from service.alerting.found import Found

BEFORE, NOW, LATER = START - DAY, START + 10 * DAY, START + 20 * DAY


def states(*found: Found, standing: tuple[Standing, ...] = (), acts: tuple[Act, ...] = ()) -> dict[str, str]:
    return {verdict.cause: verdict.state for verdict in decide(found, standing, acts)}


def acknowledged(found: Found) -> Act:
    return Act(found.cause, NOW, "Jo", "a note", ends=False, evidence=found.evidence)


def inspected(found: Found) -> Act:
    return Act(found.cause, NOW, "Jo", "a note", ends=True, evidence=found.evidence)


def test_evidence_gathers_then_fires_and_is_acknowledged() -> None:
    assert states(softer(is_sure=False)) == {"stiffness/x": "pending"}
    assert states(softer()) == {"stiffness/x": "active"}
    assert states(softer(), acts=(acknowledged(softer()),)) == {"stiffness/x": "acknowledged"}


def test_an_inspection_answers_what_began_before_it_and_is_no_worse() -> None:
    acts = (inspected(softer(8.0)),)
    assert states(softer(8.5), acts=acts) == {}
    assert states(softer(15.0), acts=acts) == {"stiffness/x": "active"}
    assert states(softer(8.0, began_at=LATER), acts=acts) == {"stiffness/x": "active"}


def test_what_was_acknowledged_and_grew_fires_again() -> None:
    assert states(softer(15.0), acts=(acknowledged(softer(8.0)),)) == {"stiffness/x": "active"}


def test_deterioration_ends_by_revised_data_only() -> None:
    told = Standing("stiffness/x", "deterioration", was_active=True, is_revised=False)
    revised = Standing("stiffness/x", "deterioration", was_active=True, is_revised=True)
    assert states(standing=(told,)) == {}
    assert states(softer(is_sure=False), standing=(told,)) == {}
    assert states(standing=(revised,)) == {"stiffness/x": "withdrawn"}
    assert states(softer(is_sure=False), standing=(revised,)) == {"stiffness/x": "pending"}


def test_what_never_was_active_is_withdrawn_and_data_resolve_by_themselves() -> None:
    pending = Standing("stiffness/x", "deterioration", was_active=False, is_revised=False)
    source = Standing("source", "data", was_active=True, is_revised=False)
    assert states(standing=(pending,)) == {"stiffness/x": "withdrawn"}
    assert states(standing=(source,)) == {"source": "resolved"}


def test_a_sensor_holds_back_what_is_found_with_it_until_it_is_settled() -> None:
    assert states(softer(), gain()) == {"stiffness/x": "on_hold", gain().cause: "active"}
    assert states(softer(), gain(), acts=(inspected(gain()),)) == {"stiffness/x": "active"}
    assert states(softer()) == {"stiffness/x": "active"}


def test_a_sensor_holds_back_nothing_else() -> None:
    elsewhere = gain("XX.DEMO.01.HNY")
    assert states(softer(), elsewhere) == {"stiffness/x": "active", elsewhere.cause: "active"}
    assert states(softer(), gain(is_sure=False))["stiffness/x"] == "active"
    assert states(softer(), gain(began_at=LATER))["stiffness/x"] == "active"


def test_both_directions_together_and_one_of_them_are_told_once() -> None:
    """Whichever was sure first; of one earthquake both together. An inspection answers it for both."""
    both, sooner = "stiffness/xy", START + DAY
    assert states(softer(), softer(cause=both)) == {"stiffness/x": "on_hold", both: "active"}
    assert states(softer(raised_at=sooner), softer(cause=both)) == {"stiffness/x": "active", both: "on_hold"}
    assert states(softer(), softer(cause="stiffness/y")) == {"stiffness/x": "active", "stiffness/y": "active"}
    assert states(softer(), softer(cause="damping/xy")) == {"stiffness/x": "active", "damping/xy": "active"}
    assert states(softer(), softer(cause=both), acts=(inspected(softer()),)) == {}
    assert states(softer(), softer(cause="stiffness/y"), acts=(inspected(softer()),)) == {"stiffness/y": "active"}


def test_without_its_source_a_building_has_no_other_alerts_of_data() -> None:
    found = (stopped("source"), stopped("record"), stopped("channel/XX.DEMO.01.HNX"), stopped("worker"))
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
