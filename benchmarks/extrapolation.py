"""`python -m benchmarks.extrapolation` improves models of simulated rubber bearings and predicts stronger tests.

Three truths move as a real building on a shaking table did (CNP100, LAC100, SP100: 93, 120 and 142 mm). A model is
improved by these three, and its force is compared with the truth at 109, 225 and 312 mm. Each truth has errors of
force that no law explains. Two are of the kind that fits the real building: powers of past displacement, a spectrum of
elements that yield, relaxation; one of them is stiffer in its first excursions, which no effect describes. The third is
of another kind: exponentials of past displacement, three Maxwell elements and two of Bouc-Wen. All are integrated
here, in steps of a millisecond, and not by the program's own laws.

    python -m benchmarks.extrapolation               onto the screen
    python -m benchmarks.extrapolation powers        one of the truths
    python -m benchmarks.extrapolation measured      the real building: errors in earthquakes left out

Below each improvement stand two sets of effects for comparison, fitted to the same tests: those that a former choice,
by earthquakes left out in turn alone, took for the real building, and those of the first kind of truth.
"""

import sys
import time
from argparse import ArgumentParser
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from datetime import timedelta
from pathlib import Path

import numpy as np
import scipy
from numba import njit

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "support"))  # the records are the tests'

from building_models import bncs, bncs_segments

from benchmarks.table import Table
from core.analysis import AnalysisSettings, analyse
from core.arrays import Vector
from core.comparison.compared import compare_forces
from core.effects import EFFECTS
from core.fitting.fit import weighted_fit
from core.fitting.observation import Observation, observations
from core.model.isolator import Isolator
from core.signals.conditioning import band_passed
from core.workbench.cross_validation import Validated, beyond_range, validated
from core.workbench.earthquakes import EPOCH, Earthquakes, peak
from core.workbench.progress import silent

TESTS = ("CNP100", "LAC100", "SP100")
SPANS = ((0.0, 39.0), (5.0, 51.0), (0.0, 63.0))
"""s, of each test that simulated ones use: its strong motion, for the time that this takes."""
MEASURED_SPANS = ((0.0, 38.0), (5.0, 50.0), (10.0, 140.0))
"""s, of each test that the real building's use: their motion begins and ends small."""
BEGUN = ("elastic", "viscous", "hysteresis_spectrum", "recent_softening")
COMPARED = {
    "eleven effects of the former choice": (
        *BEGUN, "self_centring", "braced_relief", "mullins", "resonator", "maxwell", "softening_recovery", "loop_shape",
        "braced_viscous", "relief",
    ),
    "effects of `powers`": (
        *BEGUN, "lasting_softening", "strength_growth", "loop_shape", "stress_relaxation", "softening_recovery",
    ),
}  # fmt: skip
"""Sets of effects beside which an improvement is shown."""
STRONGER = ((1, -0.91), (0, 2.42), (2, -2.2))
"""Motions of the tests to predict: number of the earlier one, and the factor to its motion."""
BAND = (0.1, 30.0)
"""Hz, of the force."""
FINE = 10
"""Steps between samples."""
GIVEN = Isolator({"elastic": {}, "viscous": {}})
"""The model to begin with."""
PERCENT = 100.0


@njit
def powers(u: Vector, dt: float, p: Vector, ever: float) -> tuple[Vector, float]:
    """(n,) N, force of rubber whose stiffness falls as powers of the largest displacement, and that at the end.

    Args:
        u: (n,) m, displacement.
        dt: s, step.
        p: stiffness and its changes with the share of the largest displacement, powers of softening in the running
            test, ever, and of recovery, damping, strength and power of the elements, displacement of their growth, time
            of relaxation and of recovery, share by which a first excursion is stiffer.
        ever: m, largest displacement in earlier tests.
    """
    k, k_2, k_3, a, b, d, c, strength, s, growth, tau, fades, virgin = p
    least, unit = 4e-3, 0.1
    running, recent, fresh = least, 0.0, 0.0
    ever = max(ever, least)
    force, z = np.zeros(u.size), np.zeros(4)
    for i in range(u.size):
        du = u[i] - u[i - 1] if i > 0 else 0.0
        size = abs(u[i])
        is_new = size >= running and u[i] * du > 0
        running = max(running, size)
        ever = max(ever, running)
        recent = max(recent * np.exp(-dt / fades), size)
        fresh += dt / 0.15 * ((1.0 if is_new else 0.0) - fresh)
        limit, yielded = 1 + (u[i] / growth) ** 2, 0.0
        for j in range(4):
            length = 1e-3 * 10 ** (2 * j / 3)
            rate = abs(du) / length + dt / tau
            end = limit * du / (length * rate)
            z[j] = end + (z[j] - end) * np.exp(-rate)
            yielded += (length / 0.03) ** (1 - s) * z[j]
        x = size / running
        soft = (running / unit) ** -a * (ever / unit) ** -b * min(max(recent, least) / running, 1.0) ** -d
        elastic = u[i] * soft * (k + k_2 * x + k_3 * x * x) * (1 + virgin * fresh * x)
        force[i] = elastic + c * du / dt + strength * yielded
    return force, ever


@njit
def exponentials(u: Vector, dt: float, p: Vector, ever: float) -> tuple[Vector, float]:
    """The same of rubber whose stiffness falls to a limit.

    Args:
        u: (n,) m, displacement.
        dt: s, step.
        p: stiffness, that of the Maxwell elements, displacement of softening in the running test and ever, change of
            stiffness with the share of the largest displacement, damping, strengths and yield displacements of both
            Bouc-Wen elements.
        ever: m, largest displacement in earlier tests.
    """
    k, k_m, in_test, in_life, bends, c, first, d_1, second, d_2 = p
    times, shares = np.array([0.1, 0.5, 2.5]), np.array([0.16, 0.12, 0.10])
    running, z_1, z_2 = 0.0, 0.0, 0.0
    force, m = np.zeros(u.size), np.zeros(3)
    for i in range(u.size):
        du = u[i] - u[i - 1] if i > 0 else 0.0
        size = abs(u[i])
        running = max(running, size)
        ever = max(ever, size)
        soft = 0.5 + 0.28 * np.exp(-running / in_test) + 0.22 / (1 + ever / in_life)
        m = m * np.exp(-dt / times) + du * soft
        pieces = int(abs(du) / (0.05 * d_1)) + 1
        turned = 1.0 if du > 0 else -1.0
        for _ in range(pieces):
            z_1 += du / pieces / d_1 * (1 - turned * z_1 * abs(z_1))
            z_2 += du / pieces / d_2 * (1 - turned * z_2 * abs(z_2))
        x = u[i] / (running + 1e-6)
        yielded = first * z_1 + second * z_2 * (1 + 3 * size)
        force[i] = k * soft * u[i] * (1 + bends * x * x) + k_m * (shares @ m) + c * du / dt + yielded
    return force, ever


@dataclass(frozen=True, slots=True)
class Truth:
    """A layer that no model knows."""

    law: Callable[[Vector, float, Vector, float], tuple[Vector, float]]
    values: tuple[float, ...]
    unexplained: float
    """Error of the force that no law explains, over the force."""
    seed: int


TRUTHS = {
    "powers": Truth(
        powers, (3.87e6, -1.66e6, 1.34e6, 0.27, 0.115, 0.17, 1.07e5, 3.2e4, 0.65, 0.214, 1.3, 4.0, 0.0), 0.03, 65
    ),
    "virgin": Truth(
        powers, (3.2e6, -1.0e6, 1.5e6, 0.20, 0.18, 0.10, 0.7e5, 4.4e4, 0.50, 0.17, 0.8, 3.0, 0.15), 0.015, 66
    ),
    "exponentials": Truth(exponentials, (4.4e6, 4.4e6, 0.05, 0.08, 0.06, 5e4, 2.2e4, 2e-3, 3.6e4, 0.02), 0.015, 67),
}


def measured() -> tuple[Observation, ...]:
    """The real building's tests, with the slow motion restored."""
    settings = AnalysisSettings(integral="restored")
    return tuple(
        one
        for name in TESTS
        for one in observations(analyse(bncs_segments(name), bncs(), settings), bncs(), name, EPOCH)
    )


def simulated(truth: Truth, seen: Sequence[Observation]) -> tuple[tuple[Observation, ...], tuple[Observation, ...]]:
    """Tests to fit and tests to predict, with a truth's force.

    Args:
        truth: of the layer.
        seen: the real tests, for their motion.
    """
    fitted = [_at_rest(part(one, span)) for one, span in zip(seen, SPANS, strict=True)]
    stronger = [_enlarged(fitted[row], factor, day) for day, (row, factor) in enumerate(STRONGER)]
    rng, ever, made = np.random.default_rng(truth.seed), 0.0, []
    for one in (*fitted, *stronger):
        u, rate = one.layer.displacement, one.rate
        at, fine = np.arange(u.size) / rate, np.arange((u.size - 1) * FINE + 1) / (rate * FINE)
        spline = scipy.interpolate.CubicSpline(at, u)
        exact, ever = truth.law(spline(fine), 1 / (rate * FINE), np.array(truth.values), ever)
        force = band_passed(exact[::FINE], rate, BAND)
        force = force + truth.unexplained * _unexplained(force, rate, rng)
        made.append(replace(one, layer=replace(one.layer, force=force)))
    return tuple(made[:3]), tuple(made[3:])


def _unexplained(force: Vector, rate: float, rng: np.random.Generator) -> Vector:
    """(n,) N, noise between 0.2 and 3 Hz that is as strong as the force at its time."""
    noise = scipy.signal.sosfiltfilt(
        scipy.signal.butter(4, (0.2, 3.0), "band", fs=rate, output="sos"), rng.standard_normal(force.size)
    )
    power = scipy.signal.sosfiltfilt(scipy.signal.butter(2, 0.2, fs=rate, output="sos"), force**2)
    strength = np.sqrt(np.maximum(power, 0.0) + (0.05 * force.std()) ** 2)
    return np.asarray(strength * noise / noise.std() + 5e-4 / 0.015 * force.std() * rng.standard_normal(force.size))


def part(one: Observation, span: tuple[float, float]) -> Observation:
    """The part of an observation within a span, s."""
    rows = slice(*(int(at * one.rate) for at in span))
    layer, conditions = one.layer, one.conditions
    histories = ("displacement", "velocity", "force", "force_std", "displacement_std", "velocity_std")
    cut = {name: getattr(layer, name)[rows] for name in histories if isinstance(getattr(layer, name), np.ndarray)}
    return replace(
        one,
        layer=replace(layer, **cut),
        conditions=replace(conditions, **{of.name: getattr(conditions, of.name)[rows] for of in fields(conditions)}),
        ground_acceleration=None,
        accelerations=one.accelerations[:, rows],
    )


def _at_rest(one: Observation) -> Observation:
    """The motion brought to rest within its last four seconds."""
    count, fading = one.layer.displacement.size, int(3 * one.rate)
    still = int(one.rate)
    share = np.ones(count)
    share[count - fading - still : count - still] = 0.5 + 0.5 * np.cos(np.linspace(0, np.pi, fading))
    share[count - still :] = 0
    u = one.layer.displacement * share
    return replace(one, layer=replace(one.layer, displacement=u, velocity=np.gradient(u) * one.rate))


def _enlarged(one: Observation, factor: float, day: int) -> Observation:
    u, v = factor * one.layer.displacement, factor * one.layer.velocity
    start = one.start + timedelta(days=10 + day)
    made = replace(one, start=start, layer=replace(one.layer, displacement=u, velocity=v))
    return replace(made, name=f"{1000 * peak(made):.0f} mm")


def errors(model: Isolator, fitted: Sequence[Observation], stronger: Sequence[Observation] = ()) -> list[float]:
    """Error of the force over the force, by test, those to predict last."""
    return [one.misfit.nrmse for one in compare_forces(model, (*fitted, *stronger), BAND)]


def steps_table(name: str) -> Table:
    """Errors after each change of an improvement, where fitted, left out, in stronger tests, and at the truth's."""
    real = measured()
    strong = tuple(part(one, span) for one, span in zip(real, MEASURED_SPANS, strict=True))
    fitted, stronger = (strong, ()) if name == "measured" else simulated(TRUTHS[name], real)
    seen = Earthquakes.of(fitted)
    started = time.process_time()
    rows, last = [], None
    for last in validated(GIVEN, seen, GIVEN.effects, EFFECTS, silent):
        rows.append(tuple(_row(last, fitted, stronger)))
    spent = time.process_time() - started
    headings = ("change", "fitted", "left out in turn", "stronger by weaker", *([] if not stronger else ["predicted"]))
    about = (
        f"In %, of the force; {' / '.join(one.name for one in (*fitted, *stronger))}. {spent:.0f} s of processor time."
    )
    if last is not None:
        for one in beyond_range(last, seen):
            about += f" At {one.times:g} times the range: spread {one.spread:.1%}, expected error {one.error:.1%}."
    rows += [tuple(_compared(title, fitted, stronger)) for title in COMPARED]
    return Table(f"Improvement by {name}", about, headings, tuple(rows))


def _row(step: Validated, fitted: Sequence[Observation], stronger: Sequence[Observation]) -> Iterator[str]:
    each = errors(step.model, fitted, stronger)
    yield "before" if not step.change else f"{'+' if step.is_added else '−'} {step.change}"
    yield _shown(each[: len(fitted)])
    yield _shown(list(step.errors.values()))
    yield "; ".join(_shown(list(trial.errors.values())) for trial in step.trials)
    if stronger:
        yield _shown(each[len(fitted) :])


def _compared(title: str, fitted: Sequence[Observation], stronger: Sequence[Observation]) -> Iterator[str]:
    model = weighted_fit(fitted, Isolator({effect: {} for effect in COMPARED[title]})).fit.model
    each = errors(model, fitted, stronger)
    yield title
    yield _shown(each[: len(fitted)])
    yield from ("", "")
    if stronger:
        yield _shown(each[len(fitted) :])


def _shown(values: Sequence[float]) -> str:
    return " / ".join(f"{PERCENT * one:.1f}" for one in values)


def main() -> None:
    """Print the tables that the command line names."""
    parser = ArgumentParser(description="Improves models of rubber bearings and predicts stronger tests.")
    every = (*TRUTHS, "measured")
    parser.add_argument("motion", nargs="*", help=f"{', '.join(every)}; all of them if none is given")
    for wanted in parser.parse_args().motion or every:
        if wanted not in every:
            parser.error(f"{wanted!r} is none of {', '.join(every)}")
        print(steps_table(wanted).markdown(), flush=True)


if __name__ == "__main__":
    main()
