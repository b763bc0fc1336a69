"""Sensors are suspected before storeys, storeys before the mass; each suspicion states what cannot be distinguished.

A wrong mass is distinguished from scattered design values and from wrong ones.
"""

from collections.abc import Mapping
from dataclasses import asdict, replace

import numpy as np
import pytest
from building_models import ROOF, paper
from consistent_records import consistent_record, differences
from consistent_sensors import COUNT, RATE
from hypothesis import given, settings, strategies as st
from paper_records import FLOORS, START

from core.analysis import DirectionAnalysis, EventAnalysis
from core.arrays import Vector
from core.description import BuildingDescription, IsolationDesign
from core.diagnosis.building_faults import building_faults, wrong_mass
from core.diagnosis.sensor_faults import Cause
from core.estimators.result import RestoringForce, StoreyStiffness
from core.fitting.fit import Fit
from core.fitting.search import Outcome
from core.model.first_model import first_model
from core.model.isolator import Isolator
from core.record import Finding

DESIGN = IsolationDesign(k_b=475e6, c_b=6e6, F_y=655e3, D_y=1.5e-3)
MODEL = first_model(replace(paper(), isolation=replace(paper().isolation, design=DESIGN))).isolator
FREE = (("elastic", "k_b"), ("viscous", "c_b"), ("bouc_wen", "F_y"), ("bouc_wen", "D_y"), ("bouc_wen", "beta"))
SOUND: dict[str, Vector] = {}
LATE = {ROOF: np.array([0.0, 0.02, 0.0])}
SOFT = np.where(np.arange(7) == 4, np.log(0.7), 0.0)


def described() -> BuildingDescription:
    return replace(paper(), isolation=replace(paper().isolation, design=DESIGN))


def earthquakes(errors: Mapping[str, Vector], storeys: Vector, *quality: Finding) -> list[EventAnalysis]:
    """Two analyses, in which the storeys' stiffness is known to 2 %."""
    known = StoreyStiffness(storeys, np.eye(7) * 0.02**2, np.eye(7) * 100.0)
    nothing = np.zeros(COUNT)
    force = RestoringForce("smoother", nothing, nothing, nothing, nothing, (), storeys=known)
    return [
        EventAnalysis(
            start=START,
            rate=RATE,
            count=COUNT,
            directions={"x": DirectionAnalysis(force, None, ())},
            quality=quality,
            peaks={},
            pga=None,
            torsion=None,
            axial_load=None,
            refusal=None,
            record=record,
            differences=differences(record),
        )
        for record in [consistent_record(errors, 0.03, [7, number]) for number in range(2)]
    ]


def fitted(mass: float) -> Fit:
    """The design's values except for a mass that is too large by a factor."""
    model = first_model(described()).isolator
    free = (("elastic", "k_b"), ("viscous", "c_b"), ("bouc_wen", "F_y"), ("bouc_wen", "D_y"))
    effects = {
        name: {key: value * (mass if key in ("k_b", "c_b", "F_y") else 1.0) for key, value in values.items()}
        for name, values in model.effects.items()
    }
    std = 0.002 * np.array([effects[name][key] for name, key in free])
    return Fit(Isolator(effects), free, np.diag(std**2), 1.0, np.zeros(1), Outcome.SETTLED, ())


def causes(errors: Mapping[str, Vector], storeys: Vector, mass: float, *quality: Finding) -> list[Cause]:
    return [s.cause for s in building_faults(earthquakes(errors, storeys, *quality), described(), fitted(mass))]


def test_a_building_as_described_is_not_suspected() -> None:
    assert causes(SOUND, np.zeros(7), 1.0) == []
    assert building_faults([], described()) == ()


def test_an_erring_sensor_that_stays_in_use_is_all_that_is_stated() -> None:
    assert causes(LATE, SOFT, 1.15) == [Cause.SENSOR]


def test_an_excluded_sensor_does_not_hide_the_others() -> None:
    clipped = Finding("clipping", "warning", "lies flat at 3 m/s²", ROOF, 3.0)
    assert causes(SOUND, SOFT, 1.15, clipped) == [Cause.SENSOR, Cause.SUPERSTRUCTURE, Cause.MASS]


def test_a_softened_storey_is_named_with_what_it_lost() -> None:
    (fault,) = building_faults(earthquakes(SOUND, SOFT), described(), fitted(1.0))
    assert (fault.cause, fault.kind, fault.channel) == (Cause.SUPERSTRUCTURE, "storey", FLOORS[4])
    assert fault.std is not None
    assert fault.value == pytest.approx(-0.3, abs=4 * fault.std)
    assert f"storey below '{FLOORS[4]}'" in fault.message
    assert "Floor masses" not in fault.message


def test_a_softened_storey_that_wrong_masses_could_stand_for_says_so() -> None:
    both = earthquakes(SOUND, SOFT)
    for analysis in both:
        force = analysis.directions["x"].restoring_force
        assert force.storeys is not None
        hidden = replace(force.storeys, deviation=np.zeros(7), with_given_masses=force.storeys, evidence_of_masses=4.0)
        analysis.directions["x"] = replace(analysis.directions["x"], restoring_force=replace(force, storeys=hidden))
    (fault,) = building_faults(both, described())
    assert (fault.kind, fault.channel) == ("storey", FLOORS[4])
    assert "Floor masses that differ from the building file would explain some of the records" in fault.message


@pytest.mark.parametrize(("mass", "printed"), [(1.12, "too large"), (0.88, "too small")])
def test_a_wrong_mass_names_its_alternatives(mass: float, printed: str) -> None:
    (fault,) = building_faults(earthquakes(SOUND, np.zeros(7)), described(), fitted(mass))
    assert (fault.cause, fault.kind, fault.channel) == (Cause.MASS, "mass", None)
    assert fault.std is not None
    assert fault.value == pytest.approx(mass - 1, abs=2 * fault.std)
    assert printed in fault.message
    assert "cannot distinguish this from isolators" in fault.message
    assert "Check the masses in the building file" in fault.message


def test_without_a_fit_the_mass_is_not_judged() -> None:
    assert building_faults(earthquakes(SOUND, np.zeros(7)), described()) == ()


def deviating_fit(factors: Vector, beta: float = 0.5, error: float = 0.005) -> Fit:
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
    mass_error = wrong_mass(deviating_fit(factors, beta), MODEL, asdict(DESIGN))
    assert mass_error is not None
    assert abs(mass_error.change - sign * off) < 4 * mass_error.std


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10**6))
def test_the_designs_scatter_is_no_wrong_mass(seed: int) -> None:
    scatter = np.exp(0.02 * np.random.default_rng(seed).standard_normal(4))
    assert wrong_mass(deviating_fit(scatter), MODEL, asdict(DESIGN)) is None


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
    assert wrong_mass(deviating_fit(np.array(factors)), MODEL, asdict(DESIGN)) is None


def test_one_value_alone_shows_no_mass() -> None:
    given_values = {"k_b": DESIGN.k_b, "c_b": None, "F_y": None, "D_y": None}
    assert wrong_mass(deviating_fit(np.array([1.2, 1.2, 1.2, 1.0])), MODEL, given_values) is None


def test_a_model_without_hysteresis_shows_it_by_stiffness_and_damping() -> None:
    linear = Isolator({name: MODEL.effects[name] for name in ("elastic", "viscous")})
    fit = deviating_fit(np.array([1.2, 1.2, 1.0, 1.0]))
    kept = Isolator({name: fit.model.effects[name] for name in ("elastic", "viscous")})
    mass_error = wrong_mass(
        replace(fit, model=kept, free=FREE[:2], covariance=fit.covariance[:2, :2]), linear, asdict(DESIGN)
    )
    assert mass_error is not None
    assert mass_error.change == pytest.approx(0.2, abs=4 * mass_error.std)
