"""Columns of effects, group by group, and the weights of records that begin or end in motion."""

import numpy as np
import pytest
from synthetic_observations import BOUC_WEN, observations

from core.arrays import Vector
from core.fitting.data import FitData, columns, compute_columns, driving_states, groups
from core.fitting.noise import FADED, IGNORED, edge_taper
from core.model.force_response import force_history
from core.model.isolator import Isolator


@pytest.mark.parametrize(
    ("effects", "expected"),
    [
        (("elastic", "viscous", "bouc_wen"), {("elastic",), ("viscous",), ("bouc_wen",)}),
        (("elastic", "bouc_wen", "heating"), {("elastic",), ("bouc_wen", "heating")}),
        (("elastic", "bouc_wen", "temperature_stiffness", "friction"), {("bouc_wen",), ("friction",)}),
        (("elastic", "viscous", "temperature_stiffness"), {("elastic", "temperature_stiffness"), ("viscous",)}),
        (("elastic", "friction", "vertical_load"), {("elastic",), ("friction", "vertical_load")}),
    ],
)
def test_effects_fall_into_groups_that_know_nothing_of_each_other(
    effects: tuple[str, ...], expected: set[tuple[str, ...]]
) -> None:
    result = set(groups(effects))
    assert expected <= result
    assert sorted(name for group in result for name in group) == sorted(effects)


def test_columns_of_proportional_parameters_add_up_to_the_force() -> None:
    """1e-9: the same numbers, added in another order."""
    seen = observations(BOUC_WEN, 0.01, 1, peaks=(0.01, 0.05), seconds=20.0)
    data = FitData.by_noise(seen)
    total = np.zeros_like(data.target)
    for (name,) in groups(BOUC_WEN.effects):
        values = BOUC_WEN.effects[name]
        key = {"elastic": "k_b", "viscous": "c_b", "bouc_wen": "F_y"}[name]
        total += values[key] * data.whitened(columns(data, Isolator({name: values}), [(name, key)]))[0]
    for one, band, span in zip(seen, data.whitenings, data.spans, strict=True):
        force = force_history(BOUC_WEN, one.layer.displacement, one.layer.velocity, one.rate, one.conditions)
        assert total[span] == pytest.approx(band.of(force[None])[0], abs=1e-9 * np.abs(total).max())


SCALED = {"strength_step": {"change": -0.3, "date": 5.0}, "vertical_load": {"share": 0.7}}


def test_states_depend_on_what_their_laws_read_and_not_on_what_scales_forces_alone() -> None:
    assert driving_states(("bouc_wen", "strength_step", "vertical_load")) == ("bouc_wen",)
    assert driving_states(("bouc_wen", "pinching")) == ("bouc_wen", "pinching")
    assert driving_states(("elastic", "stiffness_step")) == ()
    assert driving_states(("bouc_wen", "heating", "strength_step")) == ("bouc_wen", "heating")


@pytest.mark.parametrize("scale", SCALED)
def test_a_scaled_force_is_the_same_by_columns_as_in_one_integration(scale: str) -> None:
    """1e-9: the same numbers, added in another order."""
    (seen,) = observations(BOUC_WEN, 0.01, 1, peaks=(0.05,), seconds=20.0)
    data, whole = FitData.by_noise([seen]), Isolator({"bouc_wen": BOUC_WEN.effects["bouc_wen"], scale: SCALED[scale]})
    (column,) = columns(data, whole, [("bouc_wen", "F_y")])
    force = force_history(whole, seen.layer.displacement, seen.layer.velocity, seen.rate, seen.conditions)
    expected = data.whitenings[0].filtered(force[None])[0]
    assert whole.effects["bouc_wen"]["F_y"] * column == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


def test_columns_of_many_models_at_once_are_those_of_each() -> None:
    seen = observations(BOUC_WEN, 0.01, 1, peaks=(0.01, 0.05), seconds=20.0)
    together, alone = FitData.by_noise(seen), FitData.by_noise(seen)
    asked = [
        (Isolator({"friction": {"slip": slip}}), (("friction", "sliding"), ("friction", "a"))[:count])
        for slip in (3e-4, 5e-4, 1e-3)
        for count in (1, 2)
    ]
    compute_columns(together, asked)
    for model, wanted in asked:
        known = together.memory.of(((wanted), *((n, *v.values()) for n, v in model.effects.items())), pytest.fail)
        assert np.array_equal(known, columns(alone, model, wanted))


def test_what_the_layer_keeps_passes_from_one_earthquake_to_the_next() -> None:
    """Rubber that was strained before is softer: the same record as the second of two, the first one larger."""
    soft = Isolator({"mullins": {"k_M": 1e8, "u_M": 0.02}})
    small, large = observations(BOUC_WEN, 0.01, 2, peaks=(0.005, 0.08), seconds=20.0)
    alone = columns(FitData.by_noise([small]), soft, [("mullins", "k_M")])
    after = FitData.by_noise([large, small])
    later = columns(after, soft, [("mullins", "k_M")])[:, after.spans[1]]
    assert np.linalg.norm(later) < 0.1 * np.linalg.norm(alone)


RATE = 100.0


def force(seconds: float, begins: float, ends: float) -> Vector:
    """N: 1 Hz, for two seconds at the ends as strong as is said, 1 in between."""
    time = np.arange(0, seconds, 1 / RATE)
    strength = np.interp(time, [2, seconds / 3, 2 * seconds / 3, seconds - 2], [begins, 1.0, 1.0, ends])
    return np.asarray(strength * np.sin(2 * np.pi * time))


def test_all_of_a_record_that_begins_and_ends_at_rest() -> None:
    assert edge_taper(force(60, 0.0, 0.0), RATE) == pytest.approx(np.ones(6000))


@pytest.mark.parametrize(("begins", "ends"), [(0.3, 0.0), (0.0, 0.3), (0.3, 0.3)])
def test_nothing_at_an_end_in_motion(begins: float, ends: float) -> None:
    result = edge_taper(force(90, begins, ends), RATE)
    first, last = (round(one * RATE) for one in (IGNORED, FADED))
    for motion, window in ((begins, result), (ends, result[::-1])):
        assert window[:first].max() == (0.0 if motion else 1.0)
        assert window[last : 60 * 100 // 2].min() == 1.0
    assert (np.diff(result[:4500]) >= 0).all()


def test_a_short_record_keeps_its_middle() -> None:
    result = edge_taper(force(20, 1.0, 1.0), RATE)
    assert result[1000] == 1.0
    assert np.mean(result > 0.99) >= 0.5
