from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from core.drift.quantities import QUANTITIES, quantity
from core.drift.series import Measurement, MeasurementColumns, Series, series_arrays
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


@pytest.mark.parametrize("quantity", ["stiffness", "gain"])
def test_columns_are_the_measurements_in_any_order_and_count_once(quantity: str) -> None:
    given = [measurement(1e8 + n % 5, 1e6, None if n % 4 == 0 else 0.01 * n, n // 3) for n in range(30)]
    given = [replace(one, temperature=None) if one.event % 2 else one for one in given]
    columns = MeasurementColumns.of([*given[::-1], *given[:7]])
    assert tuple(columns)[::-1][7:] == tuple(given)
    assert columns[:2] == (given[-1], given[-2])
    arrays, dated = series_arrays(Series(quantity, "x", columns))
    others, others_dated = series_arrays(Series(quantity, "x", tuple(given)))
    assert dated == others_dated
    for name in ("event", "time", "value", "variance", "amplitude", "temperature"):
        np.testing.assert_array_equal(getattr(arrays, name), getattr(others, name))
    assert arrays.value.size == len([one for one in given if quantity == "gain" or one.amplitude is not None])


def test_a_residual_displacement_may_be_negative() -> None:
    arrays, _ = series_arrays(Series("residual_displacement", "x", (measurement(-0.002, 1e-4, None),)))
    assert arrays.value.tolist() == [-0.002]


def test_quantities_by_name() -> None:
    assert {quantity(name).name for name in QUANTITIES} == set(QUANTITIES)
    with pytest.raises(ModelError, match="stiffness"):
        quantity("colour")
