"""Sketches of known laws, of nothing, and of what carries over to no other earthquake."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_observations import BOUC_WEN, observations

import core
from core.effects import EFFECTS, only
from core.errors import ModelError, RecordError
from core.fitting.observation import Observation
from core.model.force_response import force_response
from core.model.isolator import Isolator
from core.sketching.search import Found, Placed, Sketched
from core.sketching.terms import TERMS
from core.workbench.sketching import NOTHING, sketch

PEAKS = (0.05, 0.08, 0.2, 0.12)
NOISE = 0.03


def hidden(force: float, length: float, seed: int) -> tuple[Observation, ...]:
    """Observations of a layer with a force that is a wave over the displacement, which no effect is."""
    found = []
    for one in observations(BOUC_WEN, NOISE, seed, PEAKS):
        wave = force * np.sin(one.layer.displacement / length)
        found.append(replace(one, layer=replace(one.layer, force=one.layer.force + wave)))
    return tuple(found)


@pytest.mark.accuracy
def test_a_wave_over_the_displacement_is_sketched_by_its_own_formula() -> None:
    """The length to 2 % and the force to 5 %: the noise is 3 % of the whole force, and the wave is a tenth of it."""
    result = sketch(BOUC_WEN, hidden(3e6, 0.02, seed=5), name="wave_of_a_test")
    assert result.proposal is not None, result
    assert [one.term.name for one in result.proposal.law.placed] == ["wave over the displacement"]
    values = result.proposal.model.effects["wave_of_a_test"]
    assert values["length_1"] == pytest.approx(0.02, rel=0.02)
    assert values["force_1"] == pytest.approx(3e6, rel=0.05)
    assert result.dependences[0].variable == "displacement"
    assert result.chosen_here == "event 3"
    assert result.taken["all held out"] > 0.9
    assert "sin(u / length_1)" in str(result)
    text: dict[str, object] = {}
    exec(compile(result.proposal.source, "wave_of_a_test.py", "exec"), text)
    assert isinstance(text["EFFECT"], core.Effect)
    u, v = (np.array([0.0, 0.01, 0.02, 0.03]), np.ones(4))
    alone = Isolator({"wave_of_a_test": {"force_1": 2.0, "length_1": 0.02}})
    assert force_response(alone, u, v, 100.0).force == pytest.approx(2 * np.sin(u / 0.02))
    with pytest.raises(ModelError, match="cannot be called 'wave_of_a_test'"):
        sketch(BOUC_WEN, hidden(3e6, 0.02, seed=5), name="wave_of_a_test")


@pytest.mark.accuracy
def test_a_short_wave_is_found_between_the_starts_of_the_search() -> None:
    """Thirty radians at the largest displacement: a start that is a tenth off shows nothing of it there.

    Its law has the name of the one above, so that it is compiled once for both.
    """
    with only(EFFECTS):
        result = sketch(BOUC_WEN, hidden(3e6, 0.0065, seed=5), name="wave_of_a_test")
        assert result.proposal is not None, result
        assert [one.term.name for one in result.proposal.law.placed] == ["wave over the displacement"]
        assert result.proposal.law.placed[0].s == pytest.approx(0.0065, rel=0.02), "before its fit with the model"
        assert result.taken["all held out"] > 0.9


def test_the_simplest_law_is_tried_first_and_then_those_that_predict_most() -> None:
    def law(count: int, predicted: float, delta_bic: float = -100.0, taken: float = 0.5) -> Sketched:
        return Sketched((Placed(TERMS[0], 0.0),) * count, np.ones(count), taken, delta_bic, predicted, ())

    one, two, three = law(1, 0.81), law(2, 0.9), law(3, 0.95)
    assert Found((one, two, three), 5.0).supported == (two, three, one), "the first is within a tenth of the best"
    assert Found((law(1, 0.9, delta_bic=-5.0), law(2, 0.9, taken=0.04), law(3, -0.1)), 5.0).supported == ()


@pytest.mark.parametrize("seed", [11, 13, 15])
def test_nothing_is_proposed_where_nothing_is_hidden(seed: int) -> None:
    result = sketch(BOUC_WEN, observations(BOUC_WEN, NOISE, seed, PEAKS), name=f"nothing_{seed}")
    assert result.proposal is None
    assert result.ended == NOTHING
    assert f"nothing_{seed}" not in core.EFFECTS


def test_a_force_that_has_nothing_to_do_with_the_motion_gives_no_law() -> None:
    """A beat as large as the wave above, of another phase in each earthquake."""
    rng, found = np.random.default_rng(17), []
    for one in observations(BOUC_WEN, NOISE, 17, PEAKS):
        t = one.conditions.time - one.conditions.time[0]
        strange = 2e6 * np.sin(2 * np.pi * rng.uniform(1, 3) * t + rng.uniform(0, 6))
        found.append(replace(one, layer=replace(one.layer, force=one.layer.force + strange)))
    assert sketch(BOUC_WEN, found, name="beat_of_a_test").proposal is None


def test_records_that_are_all_held_out_are_refused() -> None:
    seen = observations(BOUC_WEN, NOISE, 3, PEAKS[:2])
    with pytest.raises(RecordError):
        sketch(BOUC_WEN, seen, hold_out=[one.name for one in seen], name="none_of_a_test")
