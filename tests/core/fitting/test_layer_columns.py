"""Groups of effects that know nothing of each other, and what each parameter does to the force, record by record."""

import numpy as np
import pytest
from observed import BOUC_WEN, observations

from core.fitting.layer_columns import Evidence, columns, groups
from core.model.force_response import force_history
from core.model.isolator import Isolator


@pytest.mark.parametrize(
    ("effects", "expected"),
    [
        (("elastic", "viscous", "bouc_wen"), {("elastic",), ("viscous",), ("bouc_wen",)}),
        (("elastic", "bouc_wen", "heating"), {("elastic",), ("bouc_wen", "heating")}),
        (("elastic", "bouc_wen", "temperature_stiffness", "friction"), {("bouc_wen",), ("friction",)}),
    ],
)
def test_effects_fall_into_groups_that_know_nothing_of_each_other(
    effects: tuple[str, ...], expected: set[tuple[str, ...]]
) -> None:
    found = set(groups(effects))
    assert expected <= found
    assert sorted(name for group in found for name in group) == sorted(effects)


def test_columns_of_proportional_parameters_add_up_to_the_force() -> None:
    """1e-9: the same numbers, added in another order."""
    seen = observations(BOUC_WEN, 0.01, 1, peaks=(0.01, 0.05), seconds=20.0)
    evidence = Evidence.by_noise(seen)
    total = np.zeros_like(evidence.target)
    for (name,) in groups(BOUC_WEN.effects):
        values = BOUC_WEN.effects[name]
        key = {"elastic": "k_b", "viscous": "c_b", "bouc_wen": "F_y"}[name]
        total += values[key] * columns(evidence, Isolator({name: values}), [(name, key)])[0]
    for one, band, span in zip(seen, evidence.whitenings, evidence.spans, strict=True):
        force = force_history(BOUC_WEN, one.layer.displacement, one.layer.velocity, one.rate, one.conditions)
        assert total[span] == pytest.approx(band.of(force[None])[0], abs=1e-9 * np.abs(total).max())


def test_what_the_layer_keeps_passes_from_one_earthquake_to_the_next() -> None:
    """Rubber that was strained before is softer: the same record as the second of two, the first one larger."""
    soft = Isolator({"mullins": {"k_M": 1e8, "u_M": 0.02}})
    small, large = observations(BOUC_WEN, 0.01, 2, peaks=(0.005, 0.08), seconds=20.0)
    alone = columns(Evidence.by_noise([small]), soft, [("mullins", "k_M")])
    after = Evidence.by_noise([large, small])
    later = columns(after, soft, [("mullins", "k_M")])[:, after.spans[1]]
    assert np.linalg.norm(later) < 0.1 * np.linalg.norm(alone)
