from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from core.drift.quantities import QUANTITIES, quantity
from core.drift.series import Measurement, Series, series_arrays
from core.errors import ModelError, RecordError

NOW = datetime(2020, 5, 1, tzinfo=UTC)


def measurement(value: float = 1e8, std: float = 1e6, amplitude: float | None = 0.01, event: int = 1) -> Measurement:
    return Measurement(event, NOW + timedelta(days=event), value, std, amplitude, 12.0)


@pytest.mark.parametrize("wrong", [{"value": np.nan}, {"std": -1.0}, {"std": np.inf}, {"amplitude": np.nan}])
def test_numbers_that_are_not_finite_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(RecordError, match="event 1"):
        measurement(**wrong)


def test_a_time_needs_its_zone() -> None:
    with pytest.raises(RecordError, match="time zone"):
        Measurement(1, datetime(2020, 5, 1), 1.0, 0.1)  # noqa: DTZ001  refused without its zone


def test_measurements_without_logarithm_or_amplitude_are_omitted() -> None:
    kept = measurement()
    others = (measurement(value=-1e8), measurement(std=6e7), measurement(amplitude=None), measurement(amplitude=0.0))
    arrays, dated = series_arrays(Series("stiffness", "x", (kept, *others)))
    assert arrays.value.tolist() == [pytest.approx(np.log(1e8))]
    assert arrays.variance.tolist() == [pytest.approx(1e-4)]
    assert [one.event for one in dated] == [1]


def test_events_come_in_order_of_time() -> None:
    arrays, dated = series_arrays(
        Series("gain", "HNX", tuple(measurement(1.0, 0.01, None, event) for event in (7, 3, 5)))
    )
    assert [one.event for one in dated] == [3, 5, 7]
    assert arrays.event.tolist() == [0, 1, 2]


def test_a_residual_displacement_may_be_negative() -> None:
    arrays, _ = series_arrays(Series("residual_displacement", "x", (measurement(-0.002, 1e-4, None),)))
    assert arrays.value.tolist() == [-0.002]


def test_quantities_by_name() -> None:
    assert {quantity(name).name for name in QUANTITIES} == set(QUANTITIES)
    with pytest.raises(ModelError, match="stiffness"):
        quantity("colour")
