import numpy as np
import pytest
from hypothesis import given, strategies as st
from random_buildings import buildings

from core import paper
from core.building import (
    ShearBuilding,
    damping_matrix,
    fixed_base_modes,
    mass_matrix,
    stiffness_matrix,
    storey_stiffness_matrix,
)
from core.errors import ModelError

KIP, INCH, G = 4448.22, 0.0254, 9.80665


def test_periods_of_the_five_storey_frame() -> None:
    """Chopra (2017), sec. 13.2.6: m = 100 kips/g and k = 31.54 kips/in at each storey."""
    published = [2.0, 0.6852, 0.4346, 0.3383, 0.2966]  # s, printed to four digits
    frame = ShearBuilding(1.0, np.full(5, 100 * KIP / G), np.full(5, 31.54 * KIP / INCH), 0.0)
    assert 1 / fixed_base_modes(frame).frequency == pytest.approx(published, rel=5e-4)


def test_table_1_of_the_paper_to_its_printed_digits() -> None:
    modes = fixed_base_modes(paper.BUILDING)
    assert modes.frequency[:5].round(2).tolist() == [1.09, 2.82, 4.61, 6.06, 7.36]
    assert (100 * modes.damping_ratio[:5]).round(2).tolist() == [1.00, 2.59, 4.22, 5.55, 6.74]


def test_table_2_and_3_of_the_paper() -> None:
    """α is printed with two digits; the shapes were identified from records with 1 % noise, hence the tolerance."""
    shape = fixed_base_modes(paper.BUILDING).shape
    assert round(paper.BUILDING.damping_coefficient, 4) == 0.0029
    assert shape[paper.FOURTH_STOREY, :2] / shape[-1, :2] == pytest.approx([0.4419, -1.0053], rel=1e-3)


@given(building=buildings())
def test_modes_are_normalised_and_damped_in_proportion(building: ShearBuilding) -> None:
    """Eq 4: Φᵀ M Φ = I, Φᵀ K Φ = ω², Φᵀ C Φ = α ω² = 2 ζ ω."""
    modes = fixed_base_modes(building)
    squared = modes.angular_frequency**2
    mass, stiffness = np.diag(building.floor_mass), storey_stiffness_matrix(building.storey_stiffness)
    assert modes.shape.T @ mass @ modes.shape == pytest.approx(np.eye(6), abs=1e-9)
    assert modes.shape.T @ stiffness @ modes.shape == pytest.approx(np.diag(squared), abs=1e-9 * squared[-1])
    assert 2 * modes.damping_ratio * modes.angular_frequency == pytest.approx(building.damping_coefficient * squared)


@given(building=buildings(), layer=st.floats(0.0, 1e9))
def test_only_the_isolation_layer_holds_the_building(building: ShearBuilding, layer: float) -> None:
    """Moved as one, the building meets the layer alone, at the base slab (eq 1)."""
    together = np.ones(7)
    restoring = np.append(np.zeros(6), layer)
    assert stiffness_matrix(building, layer) @ together == pytest.approx(restoring, abs=1e-5)
    assert damping_matrix(building, layer) @ together == pytest.approx(restoring, abs=1e-5)
    assert mass_matrix(building).sum() == pytest.approx(building.total_mass)


@pytest.mark.parametrize(
    ("mass", "stiffness", "damping", "message"),
    [
        ([1.0, 2.0], [1.0], 0.0, "one mass and one storey"),
        ([1.0, -2.0], [1.0, 1.0], 0.0, "every mass must be positive, got -2"),
        ([1.0, 2.0], [1.0, 0.0], 0.0, "every stiffness must be positive, got 0"),
        ([1.0, float("nan")], [1.0, 1.0], 0.0, "every mass must be positive, got nan"),
        ([1.0, 2.0], [1.0, 1.0], -1.0, "must not be negative, got -1.0 s"),
    ],
)
def test_refuses_what_is_no_building(mass: list[float], stiffness: list[float], damping: float, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        ShearBuilding(1.0, np.array(mass), np.array(stiffness), damping)
