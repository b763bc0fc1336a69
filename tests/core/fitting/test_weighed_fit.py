"""Standard deviations that stay honest when the model lacks something; see test_fitting.py for the fit itself."""

import pytest
from observed import BOUC_WEN, observations

from core.errors import RecordError
from core.fitting.fit import fitted
from core.fitting.layer_columns import Evidence
from core.fitting.weighed_fit import weighed_fit
from core.model.isolator import Isolator

LINEAR = Isolator({"elastic": {"k_b": 4e8}, "viscous": {"c_b": 8e6}})


def test_a_right_model_is_fitted_as_by_the_noise() -> None:
    """5 %: the noise's own power in 30 s of record, by which it is weighed where that is above what was expected."""
    seen = observations(BOUC_WEN, 0.02, 5)
    plain, found = fitted(Evidence.by_noise(seen), BOUC_WEN), weighed_fit(seen, BOUC_WEN)
    assert found.inflation == pytest.approx(1.0, abs=0.2)
    for key, std in plain.std.items():
        assert found.fit.std[key] == pytest.approx(std, rel=0.05)


def test_a_model_that_lacks_hysteresis_knows_its_stiffness_worse_than_the_noise_would_have_it() -> None:
    """Fitted to other earthquakes it would be another one, by far more than the noise's deviation."""
    seen = observations(BOUC_WEN, 0.01, 6)
    plain, found = fitted(Evidence.by_noise(seen), LINEAR), weighed_fit(seen, LINEAR)
    honest = found.fit.std["elastic", "k_b"] * found.inflation**0.5
    assert honest > 3 * plain.std["elastic", "k_b"]


def test_no_record_is_weighed_to_nothing() -> None:
    seen = observations(BOUC_WEN, 0.01, 6)
    evidence = weighed_fit(seen, LINEAR).evidence
    for span in evidence.spans:
        assert evidence.target[span] @ evidence.target[span] > 0


def test_nothing_to_fit_to_is_an_error() -> None:
    with pytest.raises(RecordError, match="no earthquake is left to fit to"):
        weighed_fit((), LINEAR)
