"""Improved models beyond their range: what the benchmark does to the records."""

from dataclasses import fields

import numpy as np
from synthetic_observations import observations

from benchmarks.extrapolation import part
from core.model.isolator import Isolator


def test_a_part_of_a_record_has_all_its_histories() -> None:
    truth = Isolator({"elastic": {"k_b": 4e7}})
    whole = observations(truth, 0.0, seed=2, peaks=(0.1,))[0]
    middle = part(whole, (2.0, 5.0))
    rows = slice(int(2.0 * whole.rate), int(5.0 * whole.rate))
    assert np.array_equal(middle.layer.force, whole.layer.force[rows])
    for of in fields(whole.conditions):
        assert np.array_equal(getattr(middle.conditions, of.name), getattr(whole.conditions, of.name)[rows]), of.name
