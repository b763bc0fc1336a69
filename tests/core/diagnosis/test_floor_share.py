"""The floors' share of the mass is estimated where it is wrong, and no effect of the layer passes for it."""

from collections.abc import Mapping
from dataclasses import replace

import pytest
import scipy
from building_models import paper
from floor_motion import with_floors
from synthetic_observations import BOUC_WEN, observations

from core.diagnosis.building_faults import floor_share_fault
from core.diagnosis.floor_share import FloorShare, with_floor_share, wrong_floor_share
from core.diagnosis.sensor_faults import Cause
from core.diagnosis.worth import NoiseRatios
from core.fitting.observation import Observation
from core.model.isolator import Isolator

PEAKS = (0.01, 0.08, 0.03, 0.05)
STATED = float(paper().floor_mass.sum() / (paper().floor_mass.sum() + paper().base_mass))
HIDDEN: Mapping[str, Mapping[str, float]] = {
    "hardening": {"k3": 4e9, "k5": 0.0},
    "power_viscous": {"force": 2e6, "exponent": 0.3},
    "inerter": {"apparent_mass": 2e6},
    "friction": {"slip": 5e-4},
    "resonator": {"mass": 4e5, "frequency": 1.7, "damping": 0.03},
}


def seen(change: float, seed: int, truth: Isolator = BOUC_WEN) -> list[Observation]:
    """Four earthquakes, with a share that the building file has wrong by this relative change."""
    return [with_floors(one, change, paper()) for one in observations(truth, 0.01, seed, PEAKS)]


@pytest.mark.parametrize(("change", "seed"), [(-0.08, 3), (0.05, 4), (0.12, 5)])
def test_a_wrong_share_is_estimated_to_its_own_uncertainty(change: float, seed: int) -> None:
    *fitted, held_out = seen(change, seed)
    found = wrong_floor_share(fitted, [held_out], BOUC_WEN, paper())
    assert found is not None
    assert found.stated == pytest.approx(STATED)
    assert abs(found.change - change) < found.std < 0.2 * abs(change)
    assert found.after.fitted == pytest.approx(1.0, abs=0.1)
    assert found.worth.fitted > 0.95
    assert found.worth.held_out is not None
    assert found.worth.held_out > 0.9


def test_masses_as_they_are_show_no_wrong_share() -> None:
    *fitted, held_out = seen(0.0, 6)
    assert wrong_floor_share(fitted, [held_out], BOUC_WEN, paper()) is None


@pytest.mark.accuracy
@pytest.mark.parametrize("effect", HIDDEN)
def test_a_hidden_effect_is_no_wrong_share(effect: str) -> None:
    *fitted, held_out = seen(0.0, 7, Isolator({**BOUC_WEN.effects, effect: HIDDEN[effect]}))
    assert wrong_floor_share(fitted, [held_out], BOUC_WEN, paper()) is None


def test_beside_a_hidden_effect_the_share_is_estimated_with_it() -> None:
    both = Isolator({**BOUC_WEN.effects, "hardening": HIDDEN["hardening"]})
    *fitted, held_out = seen(-0.08, 8, both)
    found = wrong_floor_share(fitted, [held_out], both, paper())
    assert found is not None
    assert abs(found.change + 0.08) < found.std


def test_forces_without_their_parts_show_nothing() -> None:
    *fitted, held_out = seen(-0.08, 3)
    assert wrong_floor_share([replace(one, estimate=None) for one in fitted], [held_out], BOUC_WEN, paper()) is None


def test_another_share_changes_the_force_of_the_floors_motion_alone() -> None:
    one = seen(0.0, 3)[0]
    estimate = one.estimate
    assert estimate is not None
    other = with_floor_share(one, -0.1)
    assert other.layer.force == pytest.approx(estimate.rigid + 0.9 * estimate.modal)
    assert other.estimate is not None
    assert other.estimate.modal == pytest.approx(0.9 * estimate.modal)
    assert with_floor_share(replace(one, estimate=None), -0.1).layer.force is one.layer.force


NOISE = NoiseRatios(2.6, 2.5), NoiseRatios(0.9, 0.9)


def test_the_ratio_of_the_masses_and_its_deviation_follow_from_the_share() -> None:
    """Floors of 15,000 t on a slab of 5,000 t, of which the building file makes 18,000 t: a share of 0.783 for 0.75."""
    stated = 18 / 23
    found = FloorShare(stated, 0.75 / stated - 1, 0.01, *NOISE)
    ratio, std = found.ratio
    assert ratio == pytest.approx(1.2)
    slope = scipy.differentiate.derivative(
        lambda change: stated / (1 - stated) * (1 - stated * (1 + change)) / (stated * (1 + change)), found.change
    )
    assert std == pytest.approx(abs(slope.df) * 0.01)


@pytest.mark.parametrize(
    ("share", "floors", "slab"),
    [
        (0.75, "20.0 ± 0.6 % too large", "16.7 ± 0.4 % too small"),
        (0.8, "10.0 ± 0.6 % too small", "11.1 ± 0.7 % too large"),
    ],
)
def test_the_fault_states_what_is_wrong_by_how_much_what_that_explains_and_what_helps(
    share: float, floors: str, slab: str
) -> None:
    stated = 18 / 23
    fault = floor_share_fault(FloorShare(stated, share / stated - 1, 0.001 / stated, *NOISE))
    assert (fault.cause, fault.kind, fault.channel, fault.is_corrected) == (Cause.MASS, "floor_share", None, True)
    assert f"the floors have {100 * share:.2f} ± 0.10 % of the mass above the isolators by the records" in fault.message
    assert "and 78.3 % in the building file" in fault.message
    assert f"as if the floors' masses were {floors}, or the base slab's {slab}." in fault.message
    assert (
        "This explains 100 % of the excess error where the model was fitted and 100 % on held-out earthquakes: the "
        "noise ratio falls from 2.6 to 0.9."
    ) in fault.message
    assert fault.message.endswith(
        "Check the masses in the building file, correct them if they are wrong, and run the analysis again"
    )
    assert fault.value == pytest.approx(0.2 if share == 0.75 else -0.1)
