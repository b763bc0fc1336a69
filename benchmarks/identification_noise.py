"""Errors of the first mode's frequency and damping ratio at 10 % noise, by Menshin and by its peers."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

import numpy as np
from scipy import signal

from benchmarks.identification import modal_errors
from benchmarks.identifiers import IDENTIFIERS, Identifier
from benchmarks.table import Table
from benchmarks.trial import Limits, Refusal, Trial, Way, trials
from core.arrays import Matrix
from core.building import fixed_base_modes
from core.identification.identified_modes import Identification, IdentifiedMode, identified_modes
from core.identification.refinement import refined
from core.model.simulation import simulate
from core.paper import BUILDING, FOURTH_STOREY, ISOLATOR, RATE, ground_motion
from service.akt013 import recorded

NOISE = 0.1
"""Noise over each channel's root mean square."""
SEEDS = 20
ORDERS = (8, 10, 14, 20, 24)
BLOCK_ROWS = 30
DECIMATION = 3
"""To 33 Hz, what core.identification.identified_modes takes by itself: the peers get it done."""
TOO_SLOW = ("nfoursid",)
"""For so many records; its method is SLICOT's."""
SUBSPACE, OURS = "core.identification.identified_modes", "core.identification.refinement"


def tables() -> Iterator[Table]:
    """Noise on the outputs alone, and on the input too."""
    clean = motion()
    quick = {name: way for name, way in IDENTIFIERS.items() if name not in TOO_SLOW}
    yield table("Noise of 10 % on the outputs", "1/3", noisy(clean, (0.0, NOISE, NOISE), SEEDS), quick, Limits())
    yield table("Noise of 10 % on input and outputs", "half", noisy(clean, (NOISE,) * 3, SEEDS), quick, Limits())


def motion() -> Matrix:
    """(3, n) m/s² of base slab, fourth storey and roof under AKT013."""
    response = simulate(BUILDING, ISOLATOR, ground_motion(*recorded()), RATE)
    return np.vstack([response.base_acceleration, response.floor_acceleration[[FOURTH_STOREY, -1]]])


def noisy(clean: Matrix, shares: Sequence[float], seeds: int) -> list[Matrix]:
    """The records of as many seeds, white noise of a share of each channel's root mean square on it."""
    level = np.array(shares)[:, None] * np.sqrt(np.mean(clean**2, axis=1, keepdims=True))
    return [clean + level * np.random.default_rng(seed).standard_normal(clean.shape) for seed in range(seeds)]


def table(
    title: str, goal: str, records: Sequence[Matrix], identifiers: Mapping[str, Identifier], limits: Limits
) -> Table:
    """Errors of the first mode by each way; a peer's at the order that suits it best."""
    every: list[Way[Matrix]] = [
        Way(OURS, "core.identification.refinement", partial(our_errors, most_likely_modes, records)),
        Way(SUBSPACE, "core.identification.identified_modes", partial(our_errors, subspace_modes, records)),
    ]
    every += [Way(name, way.module, partial(errors, way.identify, records)) for name, way in identifiers.items()]
    return Table(
        title=title,
        about=(
            f"The paper's building and sensors under AKT013, {len(records)} draws of noise; root mean square errors. "
            f"The product uses {OURS}: errors in variables, starting from the result of {SUBSPACE}. Both choose the "
            f"order by themselves. The others get the record decimated to 33 Hz and {BLOCK_ROWS} block rows. Each has "
            f"the order, of {', '.join(str(order) for order in ORDERS[:-1])} and {ORDERS[-1]}, at which its damping is "
            "least wrong, which cannot be known without the exact values. "
            f"Goal: {goal} of the error of the damping of the best other method."
        ),
        columns=("method", "order", "ms", "f1, %", "ζ1, %", "mean error of ζ1, %"),
        rows=tuple(row(name, trial) for name, trial in trials(every, limits, rounds=1).items()),
        remark=(
            "nfoursid uses the same method as SLICOT. It is left out, because it would take minutes for so many "
            "records."
        ),
    )


def subspace_modes(record: Matrix) -> Sequence[IdentifiedMode]:
    """As the stabilisation diagram shows them."""
    return identified_modes(record[0], record[1:], RATE, Identification())


def most_likely_modes(record: Matrix) -> Sequence[IdentifiedMode]:
    """The same, refined with noise in every channel allowed for."""
    return refined(subspace_modes(record), record[0], record[1:], RATE, Identification()).modes


def our_errors(modes_of: Callable[[Matrix], Sequence[IdentifiedMode]], records: Sequence[Matrix]) -> Matrix:
    """(1, seeds, 2) of the identified mode nearest to the exact first one."""
    return np.array([[_of_nearest(modes_of(record)) for record in records]])


def _of_nearest(modes: Sequence[IdentifiedMode]) -> tuple[float, float]:
    exact = fixed_base_modes(BUILDING)
    frequency, ratio = exact.frequency[0], exact.damping_ratio[0]
    nearest = min(modes, key=lambda mode: abs(mode.frequency - frequency))
    return nearest.frequency / frequency - 1, nearest.damping_ratio / ratio - 1


def errors(identify: Callable[[Matrix, Matrix, int, int], tuple[Matrix, Matrix]], records: Sequence[Matrix]) -> Matrix:
    """(orders, seeds, 2) of the pole nearest to the exact first mode."""
    decimated = [signal.resample_poly(r / r.std(axis=1, keepdims=True), 1, DECIMATION, axis=1) for r in records]
    return np.array(
        [
            [
                modal_errors(*identify(record[:1], record[1:], BLOCK_ROWS, order), RATE / DECIMATION, BUILDING, 1)
                for record in decimated
            ]
            for order in ORDERS
        ]
    )


def row(name: str, trial: Trial[Matrix] | Refusal) -> tuple[str, ...]:
    """The errors at the best order, in percent, and the time of one identification."""
    if isinstance(trial, Refusal):
        return (name, trial.reason, "", "", "", "")
    orders, draws, _ = trial.result.shape
    scatter = 100 * np.sqrt(np.mean(trial.result**2, axis=1))
    best = int(np.argmin(np.nan_to_num(scatter[:, 1], nan=np.inf)))
    mean = 100 * np.mean(trial.result[best, :, 1])
    order = f"{ORDERS[best]}" if orders == len(ORDERS) else "chosen"
    milliseconds = 1e3 * trial.seconds / (orders * draws)
    return (name, order, f"{milliseconds:.1f}", f"{scatter[best, 0]:.2f}", f"{scatter[best, 1]:.1f}", f"{mean:+.1f}")
