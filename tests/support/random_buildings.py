"""Shear buildings at random, for properties that hold for all of them."""

import numpy as np
from hypothesis import strategies as st

from core.building import ShearBuilding


def buildings(storeys: int = 6) -> st.SearchStrategy[ShearBuilding]:
    def array(low: float, high: float) -> st.SearchStrategy[np.ndarray]:
        return st.lists(st.floats(low, high), min_size=storeys, max_size=storeys).map(np.array)

    return st.builds(
        ShearBuilding,
        base_mass=st.floats(1e5, 1e7),
        floor_mass=array(1e5, 1e6),
        storey_stiffness=array(1e8, 1e9),
        damping_coefficient=st.floats(0.0, 0.01),
    )
