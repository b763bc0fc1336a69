"""The text of a fit: what it says of an error that rises."""

from records_from_observations import records_from_observations
from synthetic_observations import observations

from core.fitting.observation import Observation
from core.model.isolator import Isolator
from core.workbench.fitting import RAISED, fit


def linear(stiffness: float) -> Isolator:
    return Isolator({"elastic": {"k_b": stiffness}, "viscous": {"c_b": 6e6}})


def strong_and_weak() -> list[Observation]:
    """A strong earthquake of a soft layer and two weak ones of a stiff one, each with the same noise over its force."""
    soft, stiff = (observations(linear(k), 0.01, 7, (0.08, 0.01, 0.01)) for k in (3e8, 6e8))
    return [soft[0], *stiff[1:]]


def test_a_fit_that_raises_the_error_says_why() -> None:
    """The values as given are those of the strong earthquake, which has nearly all of the force."""
    seen = records_from_observations(strong_and_weak())
    worse = fit(linear(3e8), seen)
    before, after = (version.error(seen.fitted_names).rms for version in worse.versions)
    assert after > 2 * before
    assert worse.text[-1] == RAISED
    better = fit(linear(5.9e8), seen)
    assert RAISED not in better.text


def test_the_reason_is_not_given_where_the_error_falls() -> None:
    seen = records_from_observations(list(observations(linear(3e8), 0.01, 7)))
    assert RAISED not in fit(linear(4e8), seen).text
