"""A wrong mass is distinguished from scattered design values and from wrong ones."""

from collections.abc import Mapping
from dataclasses import asdict, replace

import numpy as np
import pytest
from building_models import paper
from hypothesis import given, settings, strategies as st

from core.arrays import Vector
from core.description import IsolationDesign
from core.diagnosis.wrong_mass import wrong_mass
from core.fitting.fit import Fit
from core.fitting.search import Outcome
from core.model.first_model import first_model
from core.model.isolator import Isolator

DESIGN = IsolationDesign(k_b=475e6, c_b=6e6, F_y=655e3, D_y=1.5e-3)
MODEL = first_model(replace(paper(), isolation=replace(paper().isolation, design=DESIGN))).isolator
FREE = (("elastic", "k_b"), ("viscous", "c_b"), ("bouc_wen", "F_y"), ("bouc_wen", "D_y"), ("bouc_wen", "beta"))


def fitted(factors: Vector, beta: float = 0.5, error: float = 0.005) -> Fit:
    """The design's values times the factors, for any given β."""
    k_b, c_b, F_y, D_y = np.array([DESIGN.k_b, DESIGN.c_b, DESIGN.F_y, DESIGN.D_y]) * factors
    scale = beta + 0.5
    yielding = {**MODEL.effects["bouc_wen"], "F_y": float(F_y * scale), "D_y": float(D_y * scale), "beta": beta}
    effects: Mapping[str, Mapping[str, float]] = {
        "elastic": {"k_b": float(k_b)},
        "viscous": {"c_b": float(c_b)},
        "bouc_wen": yielding,
    }
    std = error * np.array([effects[effect][name] for effect, name in FREE])
    return Fit(Isolator(effects), FREE, np.diag(std**2), 1.0, np.zeros(1), Outcome.SETTLED, ())


@settings(max_examples=50, deadline=None)
@given(st.sampled_from([-1.0, 1.0]), st.floats(0.1, 0.3), st.floats(0.3, 0.9), st.integers(0, 10**6))
def test_a_wrong_mass_is_reported(sign: float, off: float, beta: float, seed: int) -> None:
    """Four standard deviations; β trades with yield force and displacement and must not matter."""
    scatter = np.exp(0.01 * np.random.default_rng(seed).standard_normal(4))
    factors = scatter * np.array([*[1 + sign * off] * 3, 1.0])
    found = wrong_mass(fitted(factors, beta), MODEL, asdict(DESIGN))
    assert found is not None
    assert abs(found.change - sign * off) < 4 * found.std


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10**6))
def test_the_designs_scatter_is_no_wrong_mass(seed: int) -> None:
    scatter = np.exp(0.02 * np.random.default_rng(seed).standard_normal(4))
    assert wrong_mass(fitted(scatter), MODEL, asdict(DESIGN)) is None


@pytest.mark.parametrize(
    "factors",
    [
        [1.2, 1.2, 1.2, 1.2],  # the yield displacement too: no mass does that
        [1.2, 0.8, 1.2, 1.0],
        [1.0, 1.6, 1.0, 1.0],
        [0.8, 1.2, 0.8, 0.8],
    ],
)
def test_wrong_design_values_are_no_wrong_mass(factors: list[float]) -> None:
    assert wrong_mass(fitted(np.array(factors)), MODEL, asdict(DESIGN)) is None


def test_one_value_alone_shows_no_mass() -> None:
    given_values = {"k_b": DESIGN.k_b, "c_b": None, "F_y": None, "D_y": None}
    assert wrong_mass(fitted(np.array([1.2, 1.2, 1.2, 1.0])), MODEL, given_values) is None


def test_a_model_without_hysteresis_shows_it_by_stiffness_and_damping() -> None:
    linear = Isolator({name: MODEL.effects[name] for name in ("elastic", "viscous")})
    fit = fitted(np.array([1.2, 1.2, 1.0, 1.0]))
    kept = Isolator({name: fit.model.effects[name] for name in ("elastic", "viscous")})
    found = wrong_mass(
        replace(fit, model=kept, free=FREE[:2], covariance=fit.covariance[:2, :2]), linear, asdict(DESIGN)
    )
    assert found is not None
    assert found.change == pytest.approx(0.2, abs=4 * found.std)
