"""The compiled program: combinations without recompiling, scales before forces."""

import numpy as np
import pytest

from core.effect import Effect, LogNormal, Parameter
from core.effects import EFFECTS
from core.model.program import compiled_force, force_program_source, in_opcode_order


def halving(share: float) -> float:
    return 1.0 - share


HALVING = Effect(
    title="Halving",
    law=halving,
    acts_on="strength",
    parameters=(Parameter("share", "1", (0.0, 1.0), LogNormal(0.5, 1.0), "of the strength that is lost"),),
    absent={"share": 0.0},
    family="hysteresis",
    explanation="",
    suspect_when="",
    source="",
)


def test_an_effect_that_scales_acts_on_the_forces_of_the_kind() -> None:
    effects = {"bouc_wen": EFFECTS["bouc_wen"], "zz_halving": HALVING}
    order = in_opcode_order(effects)
    assert order[0] == "zz_halving"
    force = compiled_force(effects)
    hysteresis, scale = order.index("bouc_wen"), order.index("zz_halving")
    values = np.array([2e6, 1e-2, 1.0, 0.5, 0.5, 1.0, 0.25])
    states, rates = np.array([0.5]), np.zeros(1)

    def run(opcode: list[int], at_p: list[int]) -> float:
        slots = np.array(opcode), np.array(at_p), np.zeros(len(opcode), dtype=int)
        layer, inertance = force(0.01, 0.0, 0.0, 0.0, 1.0, 20.0, 0.0, 0.0, 2.5e-3, *slots, values, states, rates)
        assert inertance == 0.0
        return layer

    assert run([hysteresis], [0]) == pytest.approx(1e6)
    assert run([scale, hysteresis], [6, 0]) == pytest.approx(0.75e6)
    assert len(force.signatures) == 1  # type: ignore[attr-defined]  # one compilation served both models


def test_the_source_has_one_branch_for_every_effect() -> None:
    text = force_program_source(EFFECTS)
    assert all(text.count(f"= law_{name}(") == 1 for name in EFFECTS)


@pytest.mark.parametrize("name", ["temperature", "strength", "force", "opcode"])
def test_an_effect_may_bear_the_name_of_what_laws_read(name: str) -> None:
    only = {name: EFFECTS["elastic"]}
    slot = np.zeros(1, dtype=int)
    stiffness = np.array([2e6])
    motion = (0.1, 0.0, 0.0, 0.0, 1.0, 20.0, 0.0, 0.0, 2.5e-3)
    force = compiled_force(only)(*motion, slot, slot, slot, stiffness, np.zeros(0), np.zeros(0))
    assert force == (pytest.approx(2e5), 0.0)
