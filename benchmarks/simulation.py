"""Response of the paper's building on its isolation layer: time and error of ours and of the peers."""

from collections.abc import Iterator, Mapping
from functools import partial

import numpy as np

from benchmarks.integrators import INTEGRATORS, OURS, Integrator
from benchmarks.table import Table
from benchmarks.trial import ROUNDS, Limits, Refusal, Trial, Way, trials
from core.arrays import Vector
from core.model.simulation import simulate
from core.paper import BUILDING, ISOLATOR, RATE, ground_motion
from service.akt013 import recorded

CONVERGED = 200
"""Steps a sample: the error left is a hundredth of the least one in the table."""


def tables() -> Iterator[Table]:
    """One, of a record of 180 s."""
    yield table(ground_motion(*recorded()), INTEGRATORS, Limits())


def table(ground: Vector, integrators: Mapping[str, Integrator], limits: Limits, rounds: int = ROUNDS) -> Table:
    """All ways under one ground motion."""
    truth = simulate(BUILDING, ISOLATOR, ground, RATE, substeps=CONVERGED).force
    ways = [Way(name, way.module, partial(way.integrate, ground)) for name, way in integrators.items()]
    found = trials(ways, limits, rounds)
    reference = found[OURS]
    quickest = reference.seconds if isinstance(reference, Trial) else np.nan
    return Table(
        title=f"{ground.size:,} samples, 8 degrees of freedom and Bouc-Wen",
        about=(
            "AKT013 scaled to 70 gal. The error is that of the layer's force, relative in the norm, to a run with 200 "
            "steps per sample. Methods are compared where their error is at most 2e-4. Goal: 1000 times as fast as "
            "LSODA, 400 times as OpenSeesPy."
        ),
        columns=("method", "ms", f"/ {OURS}", "error of the force"),
        rows=tuple(row(name, trial, quickest, truth) for name, trial in found.items()),
        remark=(
            "Compilation is not counted. It takes some seconds in every process, for Menshin and for JAX. LSODA calls "
            "its rates in Python, as it usually does."
        ),
    )


def row(name: str, trial: Trial[Vector] | Refusal, quickest: float, truth: Vector) -> tuple[str, ...]:
    """Time of one method, and the error of its force."""
    if isinstance(trial, Refusal):
        return (name, trial.reason, "", "")
    error = np.linalg.norm(trial.result - truth) / np.linalg.norm(truth)
    return (name, f"{1e3 * trial.seconds:.1f}", f"{trial.seconds / quickest:.1f}", f"{error:.1e}")
