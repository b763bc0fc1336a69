import numpy as np
import pytest
from layer_observations import BAND, LATER, START, layer_observation

from core.comparison.block_corrections import BlockCorrection, block_corrections
from core.comparison.compared import compare_forces
from core.model.isolator import Isolator
from core.paper import ISOLATOR


def corrections(model: Isolator, truth: Isolator = ISOLATOR, *scales: float) -> tuple[BlockCorrection, ...]:
    seen = [
        layer_observation(n, truth, scale=scale, start=START + n * LATER) for n, scale in enumerate(scales or (1.0,))
    ]
    return block_corrections(model, compare_forces(model, seen, BAND))


def test_a_missing_stiffness_is_requested_by_every_block() -> None:
    softer = Isolator({**ISOLATOR.effects, "elastic": {"k_b": 400e6}})
    blocks = corrections(softer)
    assert len(blocks) > 10
    apart = np.array([(one.stiffness - 75e6) / one.stiffness_std for one in blocks])
    assert np.mean(np.abs(apart) < 2) > 0.8  # 95 % if the deviations were exact
    strong = [one for one in blocks if one.amplitude > 0.02]
    assert [one.stiffness for one in strong] == pytest.approx([75e6] * len(strong), rel=0.1)


def test_a_missing_yield_force_is_requested_by_the_blocks_that_yield() -> None:
    weaker = Isolator({**ISOLATOR.effects, "bouc_wen": {**ISOLATOR.effects["bouc_wen"], "F_y": 400e3}})
    strong = [one for one in corrections(weaker) if one.amplitude > 0.01]
    assert strong
    assert np.median([one.yield_force for one in strong if one.yield_force is not None]) == pytest.approx(
        255.4e3, rel=0.1
    )


def test_a_model_without_hysteresis_has_no_yield_force_to_correct_but_a_stiffness_that_falls_with_amplitude() -> None:
    linear = Isolator({name: values for name, values in ISOLATOR.effects.items() if name != "bouc_wen"})
    blocks = corrections(linear)
    assert {one.yield_force for one in blocks} == {None}
    weak, strong = ([one.stiffness for one in blocks if (one.amplitude > 5e-3) == large] for large in (False, True))
    assert np.median(weak) > 5 * np.median(strong) > 0


def test_travel_goes_on_from_earthquake_to_earthquake() -> None:
    travel = [one.travel for one in corrections(ISOLATOR, ISOLATOR, 1.0, 1.0)]
    assert travel == sorted(travel)
    assert travel[-1] > 1.5 * travel[len(travel) // 2 - 1]


def test_a_block_in_which_the_layer_barely_yields_shows_no_yield_force() -> None:
    """The yield displacement is 1.5 mm."""
    weaker = Isolator({**ISOLATOR.effects, "bouc_wen": {**ISOLATOR.effects["bouc_wen"], "F_y": 400e3}})
    blocks = corrections(weaker)
    small = [one for one in blocks if one.amplitude < 0.5e-3]
    assert small
    assert {one.yield_force for one in small} == {None}
    reported = [one.yield_std for one in blocks if one.yield_force is not None and one.yield_std is not None]
    assert max(reported) < 0.25 * 700e3
