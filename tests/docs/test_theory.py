"""The theory page names existing modules, and its picture shows the exact transfer function."""

import importlib.util
import re
from pathlib import Path
from pkgutil import resolve_name

import numpy as np
import pytest

from core.building import storey_stiffness_matrix
from core.paper import BUILDING

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = importlib.util.spec_from_file_location(
    "write_theory_pictures", ROOT / "docs" / "tools" / "write_theory_pictures.py"
)
assert SCRIPT is not None
assert SCRIPT.loader is not None
pictures = importlib.util.module_from_spec(SCRIPT)
SCRIPT.loader.exec_module(pictures)


def test_all_that_it_names_exists() -> None:
    text = (ROOT / "docs" / "reference" / "theory.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`(core\.[\w.]+)`", text))
    assert len(named) > 15
    for name in named:
        resolve_name(name)


def test_the_modes_give_the_transfer_of_the_equation_of_motion() -> None:
    """(K (1 + iωα) - ω² M) x = ω² M r a / ω²: solved at once, without modes; 1e-9 is rounding."""
    K, M = storey_stiffness_matrix(BUILDING.storey_stiffness), np.diag(BUILDING.floor_mass)
    ω = 2 * np.pi * pictures.FREQUENCY
    damped = K * (1 + 1j * ω * BUILDING.damping_coefficient)[:, None, None] - (ω**2)[:, None, None] * M
    relative = np.linalg.solve(damped, np.broadcast_to(BUILDING.floor_mass, (ω.size, len(M)))[..., None])[..., 0]
    assert pictures.floor_transfer() == pytest.approx(1 + (ω**2)[:, None].T * relative.T, rel=1e-9)


def test_all_sensors_give_the_exact_force() -> None:
    transfer = pictures.floor_transfer()
    exact = np.abs(BUILDING.base_mass + BUILDING.floor_mass @ transfer) / BUILDING.total_mass
    assert pictures.static_force(transfer, np.arange(BUILDING.floor_mass.size)) == pytest.approx(exact, rel=1e-9)
