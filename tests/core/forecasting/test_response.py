"""Forecasts against exact responses of a linear building, and their intervals on simulated records."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from math import exp, log, sqrt

import numpy as np
import pytest
from building_models import paper
from ground_motions import RATE, akt013, kobe
from layer_observations import BAND, layer_observation
from scipy.linalg import expm
from scipy.stats import t as student
from synthetic_observations import BOUC_WEN, observations

from core.arrays import Vector
from core.building import damping_matrix, fixed_base_modes, mass_matrix, stiffness_matrix
from core.comparison.compared import compare_forces
from core.comparison.prediction import Start, predict
from core.errors import RecordError
from core.fitting.fit import weighted_fit
from core.fitting.observation import Observation
from core.forecasting import response
from core.forecasting.experience import Experience, Miss, Spread, experience
from core.forecasting.ground_motion import GroundMotion, Scaling, ToDisplacement, ToPga
from core.forecasting.response import Forecast, Forecaster, Setting, own_error
from core.model.isolator import Isolator
from core.paper import BUILDING, ISOLATOR
from core.record import Direction

LINEAR = Isolator({"elastic": {"k_b": 400e6}, "viscous": {"c_b": 8e6}})
MODES = fixed_base_modes(BUILDING)
LAST = datetime(2024, 1, 1, tzinfo=UTC)
MOTION = GroundMotion.of("AKT013", RATE, x=akt013()[: round(60 * RATE)])


def known(**given: object) -> Experience:
    """Experience without errors, of strong records."""
    usual = Experience(
        spread=Spread((), np.zeros((0, 0)), np.zeros(0), ()),
        misses=(),
        displacement=10.0,
        velocity=10.0,
        asleep=(),
        temperatures=(20.0, 20.0),
        states={},
        superstructures={"x": MODES, "y": MODES},
        period=3.0,
        last=LAST,
    )
    return replace(usual, **given)  # type: ignore[arg-type]  # names of fields


def forecaster(model: Isolator = LINEAR, directions: tuple[Direction, ...] = ("x",), **given: object) -> Forecaster:
    return Forecaster(model, directions, paper(), known(**given), LAST)


def exact_response(k: float, c: float, ground: Vector, rate: float) -> tuple[Vector, Vector]:
    """(n,) m of the layer and (levels, n) m/s², the slab first: by the building's matrices, exactly."""
    mass, size = mass_matrix(BUILDING), BUILDING.floor_mass.size + 1
    stiff, damped = (
        np.linalg.solve(mass, stiffness_matrix(BUILDING, k)),
        np.linalg.solve(mass, damping_matrix(BUILDING, c)),
    )
    system = np.zeros((2 * size + 2, 2 * size + 2))
    system[:size, size : 2 * size] = np.eye(size)
    system[size : 2 * size, :size], system[size : 2 * size, size : 2 * size] = -stiff, -damped
    system[size : 2 * size, 2 * size] = -1.0
    system[2 * size, 2 * size + 1] = rate
    step, state = expm(system / rate), np.zeros(2 * size)
    found = np.zeros((2 * size, ground.size))
    for n in range(1, ground.size):
        state = (step @ np.concatenate([state, [ground[n - 1], ground[n] - ground[n - 1]]]))[: 2 * size]
        found[:, n] = state
    absolute = -stiff @ found[:size] - damped @ found[size:]
    return found[size - 1], np.vstack([absolute[-1], absolute[:-1]])


def followed(samples: Vector) -> Vector:
    return np.concatenate([samples, np.zeros(round(response.AFTERWARDS * RATE))])


def test_a_linear_building_answers_as_its_matrices_do() -> None:
    """1e-4: the steps of the simulation; see core.model.simulation."""
    ground = MOTION.accelerations["x"]
    moved, absolute = exact_response(400e6, 8e6, followed(ground - ground[0]), RATE)
    found = forecaster().forecast(MOTION)
    assert found.peak("displacement").value == pytest.approx(np.abs(moved).max(), rel=1e-4)
    levels = [level.name for level in paper().levels[1:]]
    for level, row in zip(levels, absolute, strict=True):
        assert found.peak("acceleration", level).value == pytest.approx(np.abs(row).max(), rel=1e-4), level


def test_the_interval_is_that_of_the_exact_derivative() -> None:
    """Deviation of the peaks by the exact response's slopes; stiffness known to 3 %, damping to 10 %."""
    ground, levels = followed(MOTION.accelerations["x"]), [level.name for level in paper().levels[1:]]
    keys = (("elastic", "k_b"), ("viscous", "c_b"))
    spread = Spread(keys, np.diag([0.03, 0.10]), np.ones(2), (True, True))
    found = forecaster(spread=spread).forecast(MOTION)

    def peaks(k: float, c: float) -> Vector:
        moved, absolute = exact_response(400e6 * exp(k), 8e6 * exp(c), ground, RATE)
        return np.log([np.abs(moved).max(), *np.abs(absolute).max(axis=1)])

    slopes = np.array([(peaks(0.03, 0) - peaks(-0.03, 0)) / 2, (peaks(0, 0.1) - peaks(0, -0.1)) / 2])
    expected = np.sqrt(np.sum(slopes**2, axis=0))
    every = [found.peak("displacement"), *(found.peak("acceleration", level) for level in levels)]
    for peak, exact in zip(every, expected, strict=True):
        assert peak.by_values == pytest.approx(exact, abs=1e-3), peak
        by_model, freedom = own_error((), peak.quantity, peak.level, 0.1, 1.0)
        reach = student.ppf(0.975, freedom) * sqrt(peak.by_values**2 + by_model**2)
        assert log(peak.high / peak.value) == pytest.approx(reach) == pytest.approx(log(peak.value / peak.low))


def test_steps_are_the_covariance_of_the_fit() -> None:
    seen = observations(BOUC_WEN, 0.1, seed=3)
    done = weighted_fit(seen, BOUC_WEN)
    learnt = learn(done.fit.model, seen)
    values = np.array([done.fit.model.effects[effect][name] for effect, name in learnt.spread.keys])
    rows = [done.fit.free.index(key) for key in learnt.spread.keys]
    expected = done.inflation * done.fit.covariance[np.ix_(rows, rows)] / np.outer(values, values)
    steps = learnt.spread.steps * learnt.spread.lengths[:, None]
    assert steps.T @ steps == pytest.approx(expected, rel=0.05, abs=0.05 * np.abs(expected).max())
    assert all(learnt.spread.in_logarithm)


def learn(model: Isolator, seen: tuple[Observation, ...]) -> Experience:
    forces = compare_forces(model, seen, BAND)
    return experience(model, forces, (), seen, {"x": MODES}, paper())


@pytest.mark.accuracy
def test_the_values_intervals_cover_the_truth() -> None:
    """Models fitted to noisy records of one layer, and the response of the true one to another earthquake.

    Errors over deviations have a root mean square of 1; of 40 draws its own deviation is 0.11, and these bounds are
    three of them.
    """
    strong = GroundMotion.of("Kobe", RATE, x=kobe()[: round(60 * RATE)]).times(3.0)
    truth = forecaster(BOUC_WEN).forecast(strong)
    errors = []
    for seed in range(40):
        seen = observations(BOUC_WEN, 0.3, seed=seed)
        model = weighted_fit(seen, BOUC_WEN).fit.model
        peak = (
            Forecaster(model, ("x",), paper(), learn(model, seen), seen[0].start).forecast(strong).peak("displacement")
        )
        errors.append(log(truth.peak("displacement").value / peak.value) / peak.by_values)
    assert 0.67 < sqrt(np.mean(np.square(errors))) < 1.33


def test_records_show_the_models_own_error() -> None:
    """A model that is 10 % too soft: its misses are those of its predictions, and its intervals hold the truth."""
    soft = Isolator({**ISOLATOR.effects, "elastic": {"k_b": 0.9 * 475e6}})
    seen = tuple(
        layer_observation(seed, scale=scale, start=LAST + timedelta(days=seed)) for seed, scale in ((1, 1.0), (2, 2.0))
    )
    predicted = [predict([Start(MODES, one)], soft, paper(), BAND)[0] for one in seen]
    learnt = experience(soft, compare_forces(soft, seen, BAND), predicted, seen, {"x": MODES}, paper())
    moved = [one for one in learnt.misses if one.kind == "displacement"]
    assert [one.peak for one in moved] == pytest.approx(
        [log(np.abs(one.displacement.measured).max() / np.abs(one.displacement.model).max()) for one in predicted]
    )
    by = Forecaster(soft, ("x",), paper(), learnt, LAST)
    motion = GroundMotion.of("stronger", RATE, x=3 * akt013())
    truth = forecaster(ISOLATOR).forecast(motion)
    for quantity, level in (("displacement", ""), ("acceleration", "RF"), ("acceleration", "4F")):
        found = by.forecast(motion).peak(quantity, level)
        assert found.low < truth.peak(quantity, level).value < found.high
        assert found.by_model > found.by_values


def test_own_errors_weigh_by_their_amplitude() -> None:
    far, near = Miss("displacement", "", 0.01, 0.5, 0.5), Miss("displacement", "", 0.1, 0.02, 0.02)
    none, freedom = own_error((), "displacement", "", 0.1, 0.1)
    assert (none, freedom) == (response.PRIOR_ERROR, response.PRIOR_RECORDS)
    alone, _ = own_error((near,), "displacement", "", 0.1, 0.1)
    both, more = own_error((near, far), "displacement", "", 0.1, 0.1)
    equal, _ = own_error((near, replace(far, amplitude=0.1)), "displacement", "", 0.1, 0.1)
    assert alone < both < equal
    assert more == pytest.approx(response.PRIOR_RECORDS + 1.1)
    many = own_error((near,) * 10000, "displacement", "", 0.1, 0.1)[0]
    assert many == pytest.approx(0.02 * sqrt(1 + response.HISTORY**2), rel=0.01)


def test_an_own_error_grows_beyond_the_records() -> None:
    within, beyond = (own_error((), "displacement", "", 0.2, seen)[0] for seen in (0.2, 0.1))
    assert beyond**2 - within**2 == pytest.approx((response.GROWTH * log(2)) ** 2)


def test_a_floor_without_a_record_has_the_error_of_all_floors() -> None:
    misses = (Miss("acceleration", "1F", 0.1, 0.1, 0.0), Miss("acceleration", "RF", 0.1, 0.3, 0.0))
    of = {level: own_error(misses, "acceleration", level, 0.1, 0.1) for level in ("1F", "4F", "RF")}
    assert of["1F"][0] < of["4F"][0] < of["RF"][0]
    assert len({freedom for _, freedom in of.values()}) == 1
    assert own_error(misses, "drift", "4F", 0.1, 0.1)[0] > of["4F"][0]


def test_a_motion_is_scaled_until_the_isolators_move_as_far() -> None:
    found = forecaster(ISOLATOR).forecast(MOTION, ToDisplacement(0.25))
    assert found.peak("displacement").value == pytest.approx(0.25, rel=1e-3)
    assert found.motion.pga == pytest.approx(found.factor * MOTION.pga)
    small = forecaster(ISOLATOR).forecast(MOTION, ToDisplacement(0.001))
    assert small.peak("displacement").value == pytest.approx(0.001, rel=1e-3)
    assert small.factor < 1 < found.factor


def test_a_displacement_that_no_factor_reaches_is_refused() -> None:
    with pytest.raises(RecordError, match=r"no factor of this motion moves the isolators by 9,000 mm|beyond 100 m/s²"):
        forecaster(Isolator({"elastic": {"k_b": 1e11}, "viscous": {"c_b": 1e9}})).forecast(MOTION, ToDisplacement(9.0))


def test_both_directions_move_in_plan() -> None:
    both = GroundMotion.of("wave", RATE, x=akt013()[:6000], y=0.7 * akt013()[:6000])
    found = forecaster(directions=("x", "y")).forecast(both, ToPga(2.0))
    along = [found.peak("displacement", direction=direction).value for direction in ("x", "y")]
    assert along[1] == pytest.approx(0.7 * along[0])
    assert found.peak("displacement", direction="xy").value == pytest.approx(along[0] * sqrt(1.49))


def beyond(by: Forecaster, scaling: Scaling, setting: Setting = Setting()) -> Forecast:  # noqa: B008  frozen
    return by.forecast(MOTION, scaling, setting)


def test_a_motion_that_goes_farther_or_faster_than_the_records_is_out_of_range() -> None:
    misses = (Miss("displacement", "", 0.05, 0.0, 0.0),)
    by = forecaster(ISOLATOR, displacement=0.05, velocity=10.0, misses=misses)
    within = beyond(by, ToDisplacement(0.049))
    assert not within.is_out_of_range
    assert not within.remarks
    somewhat = beyond(by, ToDisplacement(0.06))
    assert not somewhat.is_out_of_range
    assert "1.2 times as far as in any record that the model was fitted to (50 mm)" in somewhat.remarks[0]
    far = beyond(by, ToDisplacement(0.3))
    assert far.beyond == (
        "The isolators would move 300 mm, 6 times as far as in any record that the model was fitted to (50 mm).",
    )
    fast = beyond(forecaster(ISOLATOR, velocity=0.01), ToDisplacement(0.06))
    assert "times as fast as in any record that the model was fitted to (10 mm/s)" in fast.beyond[0]


def test_an_effect_that_no_record_made_act_is_named_where_it_would() -> None:
    """A moat that the weak records do not reach, and one that they do."""
    model = Isolator({**ISOLATOR.effects, "moat": {"gap": 0.1, "gap_back": 0.1, "wall": 5e9, "wall_back": 5e9}})
    seen = tuple(layer_observation(seed, model, scale=2.0, start=LAST + timedelta(days=seed)) for seed in (1, 2))
    assert max(np.abs(one.layer.displacement).max() for one in seen) < 0.1
    learnt = experience(model, compare_forces(model, seen, BAND), (), seen, {"x": MODES}, paper())
    assert {effect for effect, _ in learnt.asleep} == {"moat"}
    by = Forecaster(model, ("x",), paper(), replace(learnt, displacement=1.0, velocity=10.0), LAST)
    assert not beyond(by, ToDisplacement(0.09)).is_out_of_range
    struck = beyond(by, ToPga(6.0))
    assert struck.beyond == ("No record has made this act: moat. Here it would; its values are not known.",)
    strong = (layer_observation(3, model, scale=8.0, start=LAST),)
    assert np.abs(strong[0].layer.displacement).max() > 0.11
    assert not experience(model, compare_forces(model, strong, BAND), (), strong, {"x": MODES}, paper()).asleep


def test_a_model_with_temperature_is_out_of_range_where_it_is_colder_than_any_record() -> None:
    model = Isolator({**ISOLATOR.effects, "temperature_stiffness": {}})
    by = forecaster(model, temperatures=(10.0, 25.0))
    assert not by.forecast(MOTION, None, Setting(temperature=8.0)).is_out_of_range
    cold = by.forecast(MOTION, None, Setting(temperature=-10.0))
    assert cold.beyond == ("The isolators would have −10 °C; the records have 10 to 25 °C.",)
    assert not forecaster(temperatures=(10.0, 25.0)).forecast(MOTION, None, Setting(temperature=-10.0)).beyond


def test_what_the_layer_kept_goes_on() -> None:
    """A layer that lost stiffness in a strong earthquake is softer in the next, as its states say."""
    model = Isolator({**ISOLATOR.effects, "mullins": {}})
    strong = (layer_observation(1, model, scale=8.0, start=LAST),)
    learnt = learn(model, strong)
    new = Forecaster(model, ("x",), paper(), replace(learnt, states={}), LAST).forecast(MOTION)
    used = Forecaster(model, ("x",), paper(), learnt, LAST).forecast(MOTION)
    assert np.any(learnt.states["x"])
    assert used.peak("displacement").value != pytest.approx(new.peak("displacement").value, rel=0.01)


@pytest.mark.parametrize(
    ("setting", "reason"),
    [
        (Setting(at=LAST - timedelta(days=1)), "lies before the end of the last record"),
        (Setting(at=datetime(2030, 1, 1)), "no time zone"),  # noqa: DTZ001  the point of the test
        (Setting(temperature=300.0), "temperature of the isolators must be within"),
    ],
)
def test_impossible_settings_are_refused(setting: Setting, reason: str) -> None:
    with pytest.raises(RecordError, match=reason):
        forecaster().forecast(MOTION, None, setting)


def test_a_motion_of_another_direction_is_refused() -> None:
    with pytest.raises(RecordError, match="AKT013: it has the direction y, the model is of x"):
        forecaster().forecast(GroundMotion.of("AKT013", RATE, y=akt013()))
