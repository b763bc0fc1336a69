"""The theory page names existing modules, and its picture shows the exact transfer function."""

import re
from pathlib import Path
from pkgutil import resolve_name

import numpy as np
import pytest
import write_theory_pictures

from core.building import storey_stiffness_matrix
from core.paper import BUILDING

ROOT = Path(__file__).resolve().parents[2]


def test_all_that_it_names_exists() -> None:
    text = (ROOT / "docs" / "reference" / "theory.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`(core\.[\w.]+)`", text))
    assert len(named) > 15
    for name in named:
        resolve_name(name)


def test_the_modes_give_the_transfer_of_the_equation_of_motion() -> None:
    """(K (1 + iωα) - ω² M) x = ω² M r a / ω²: solved at once, without modes; 1e-9 is rounding."""
    K, M = storey_stiffness_matrix(BUILDING.storey_stiffness), np.diag(BUILDING.floor_mass)
    ω = 2 * np.pi * write_theory_pictures.FREQUENCY
    damped = K * (1 + 1j * ω * BUILDING.damping_coefficient)[:, None, None] - (ω**2)[:, None, None] * M
    relative = np.linalg.solve(damped, np.broadcast_to(BUILDING.floor_mass, (ω.size, len(M)))[..., None])[..., 0]
    assert write_theory_pictures.floor_transfer() == pytest.approx(1 + (ω**2)[:, None].T * relative.T, rel=1e-9)


def test_all_sensors_give_the_exact_force() -> None:
    transfer = write_theory_pictures.floor_transfer()
    exact = np.abs(BUILDING.base_mass + BUILDING.floor_mass @ transfer) / BUILDING.total_mass
    assert write_theory_pictures.static_force(transfer, np.arange(BUILDING.floor_mass.size)) == pytest.approx(
        exact, rel=1e-9
    )
