"""Operations without an earthquake that a model may be fitted to."""

from collections.abc import Callable

import pytest
from records_from_observations import records_from_observations
from synthetic_observations import BOUC_WEN, observations

from core.errors import RecordError
from core.workbench import Earthquakes, add, diagnose, fit, improve, sketch


@pytest.mark.parametrize(
    "operation",
    [
        lambda seen: add("friction", BOUC_WEN, seen),
        lambda seen: diagnose(BOUC_WEN, seen),
        lambda seen: fit(BOUC_WEN, seen),
        lambda seen: improve(BOUC_WEN, seen),
        lambda seen: sketch(BOUC_WEN, seen),
    ],
    ids=["add", "diagnose", "fit", "improve", "sketch"],
)
def test_nothing_to_fit_to_is_an_error_that_helps(operation: Callable[[Earthquakes], object]) -> None:
    recorded = records_from_observations(list(observations(BOUC_WEN, 0.02, 3, (0.03, 0.05))))
    seen = Earthquakes.of(recorded.observations, [one.name for one in recorded.observations])
    with pytest.raises(RecordError, match="no earthquake is left to fit to; add one that is not held out"):
        operation(seen)
