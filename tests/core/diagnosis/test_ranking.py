"""Rules by which a candidate is proposed, and its rivals that the records cannot distinguish."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from synthetic_observations import BOUC_WEN, observations

from core.arrays import Vector
from core.diagnosis.ranking import (
    ALIKE,
    DECISIVE,
    FELT,
    SAME,
    WORTH,
    Ranking,
    Rankings,
    ScoredCandidate,
    ordered,
    ranked,
)
from core.errors import ModelError
from core.fitting.data import FitData
from core.fitting.fit import Fit, at_values
from core.model.isolator import Isolator


@cache
def seen() -> FitData:
    return FitData.by_noise(observations(BOUC_WEN, 0.02, 3, peaks=(0.05,), seconds=20.0))


@cache
def base() -> Fit:
    return at_values(seen(), BOUC_WEN)


def loud_below(frequency: float, factor: float) -> FitData:
    """The same record, with noise that is so much stronger below (Hz)."""
    (only,) = seen().whitenings
    louder = replace(only, std=only.std * np.where(only.frequency < frequency, factor, 1.0))
    return replace(seen(), whitenings=(louder,))


def leaving(share: Vector | float) -> Fit:
    """A fit that leaves this share of the power in each coefficient."""
    residual = base().residual * np.sqrt(share)
    return replace(base(), residual=residual, chi_square=float(residual @ residual))


def ranking(*candidates: ScoredCandidate, data: FitData | None = None, louder: float = 1.0) -> Ranking:
    """A ranking of a record whose noise is so much stronger in the force than in the data."""
    data = data or seen()
    floor = np.array([louder * np.linalg.norm(w.std) / np.sqrt(w.count) for w in data.whitenings])
    return Ranking(base(), candidates, data, 1.0, floor)


def supported(*candidates: ScoredCandidate, data: FitData | None = None, louder: float = 1.0) -> list[str]:
    return [one.effect for one in ranking(*candidates, data=data, louder=louder).supported]


@pytest.mark.parametrize(("removed", "named"), [(WORTH + 0.01, ["friction"]), (WORTH - 0.01, [])])
def test_an_effect_that_removes_little_is_not_supported_however_certain_it_is(removed: float, named: list[str]) -> None:
    assert supported(ScoredCandidate("friction", leaving(1 - removed), -1e4)) == named


@pytest.mark.parametrize(("delta", "named"), [(-DECISIVE - 1, ["friction"]), (-DECISIVE + 1, [])])
def test_what_is_not_certain_is_not_requested_however_much_it_takes(delta: float, named: list[str]) -> None:
    assert supported(ScoredCandidate("friction", leaving(0.5), delta)) == named


def test_what_takes_much_where_there_is_barely_a_force_is_not_felt() -> None:
    """In units of its noise much of the residual lies above 3 Hz, where the noise is a thousandth of that below."""
    data = loud_below(3.0, 1000.0)
    (only,) = data.whitenings
    above = np.where(only.frequency >= 3.0, 0.2, 1.0)
    quiet = ScoredCandidate("resonator", leaving(above), -1e4)
    left, before = (ranking(quiet, data=data).left(fit)[0] for fit in (quiet.fit, base()))
    assert quiet.fit.chi_square < (1 - WORTH) * base().chi_square
    assert left**2 > (1 - FELT) * before**2
    assert supported(quiet, data=data) == []
    assert supported(quiet) == ["resonator"], "the same of a force that is as loud there as below"


def test_what_takes_much_of_a_residual_far_below_the_noise_is_not_felt() -> None:
    half = ScoredCandidate("maxwell", leaving(0.5), -1e4)
    louder = np.sqrt(0.5 / FELT)
    assert supported(half, louder=0.9 * louder) == ["maxwell"]
    assert supported(half, louder=1.1 * louder) == []


def test_the_set_holds_what_is_as_good_as_the_best_and_what_leaves_as_little() -> None:
    best = ScoredCandidate("friction", leaving(0.5), -500.0)
    near = ScoredCandidate("breakaway", leaving(0.6), best.delta_bic + DECISIVE - 1)
    alike = ScoredCandidate("relief", leaving(0.5 * (1 + ALIKE / 2) ** 2), best.delta_bic + 100)
    worse = ScoredCandidate("moat", leaving(0.5 * (1 + 2 * ALIKE) ** 2), best.delta_bic + 100)
    assert supported(best, near, alike, worse) == ["friction", "breakaway", "relief"]


def test_the_best_that_is_worth_it_leads_even_behind_one_that_is_not() -> None:
    certain = ScoredCandidate("moat", leaving(1 - WORTH / 2), -900.0)
    assert supported(certain, ScoredCandidate("friction", leaving(0.5), -500.0)) == ["friction"]


def test_what_is_left_is_reported_in_floors() -> None:
    """Noise alone leaves a noise ratio of one, except for the three fitted amplitudes and the draw: 5 %."""
    judged = ranking()
    assert judged.noise_ratio(base()) == pytest.approx(1.0, abs=0.05)
    assert judged.noise_ratio(leaving(4.0)) == pytest.approx(2 * judged.noise_ratio(base()), rel=1e-12)


def test_candidates_that_differ_by_rounding_go_by_name() -> None:
    fit = leaving(0.5)
    scored = [
        ScoredCandidate(name, fit, bic) for name, bic in (("moat", 5.0), ("friction", 5.0 + 1e-13), ("relief", -1))
    ]
    assert [one.effect for one in ordered(scored)] == ["relief", "friction", "moat"]


def test_a_model_that_diverges_at_its_values_is_ranked_from_calmer_ones() -> None:
    """Values from beside an effect that is then left out, as of two steel-like elements: without γ, z has no bound."""
    wild = {**BOUC_WEN.effects["bouc_wen"], "D_y": 1e-5, "beta": 10.0, "gamma": 0.0}
    model = Isolator({**BOUC_WEN.effects, "bouc_wen": wild})
    with pytest.raises(ModelError, match="start from other values"):
        ranked(seen(), model, ["hardening"])
    found = ranked(seen(), model, ["hardening"], calm=BOUC_WEN)
    assert found.noise_ratio(found.base) == pytest.approx(1.0, abs=0.1)
    assert [one.effect for one in found.candidates] == ["hardening"]


def test_a_ranking_is_made_again_only_for_values_that_lead_to_less() -> None:
    model = base().model
    found = ranked(seen(), model, ["hardening"])
    beside = found.candidates[0].fit.model
    known = Rankings([found])
    assert known.known(model, None) is found
    assert known.known(model, beside) is found
    assert known.known(beside, None) is None
    worse = replace(found, base=replace(found.base, chi_square=found.base.chi_square / (1 - 2 * SAME)))
    assert Rankings([worse]).known(model, None) is None
    (candidate,) = found.candidates
    far = replace(candidate, fit=replace(candidate.fit, chi_square=2 * candidate.fit.chi_square))
    assert Rankings([replace(found, candidates=(far,))]).known(model, beside) is None
    assert Rankings([replace(found, candidates=())]).known(model, beside) is None
