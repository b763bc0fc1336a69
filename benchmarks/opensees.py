"""Diagnosis of layers that OpenSees simulates: its materials hide the effects, its algorithm integrates them.

    python -m benchmarks.opensees                     all cases with three seeds, into docs/models/diagnosis.md
    python -m benchmarks.opensees --only steel02      one case, onto the screen

Needs `pip install '.[test,benchmark]'`, and Debian's `libblas3` and `liblapack3` for OpenSeesPy. Buildings, motions and
sensors are those of `tests/support/hidden`. Every trial is kept in a file as it is done, so that
a run that was stopped goes on where it was.
"""

import json
import sys
from argparse import ArgumentParser
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass, replace
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from types import MappingProxyType
from typing import Any

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "support"))  # the generator is the tests'

import numpy as np
from hidden.law import Layer
from hidden.sensors import RATE, Noise, sampled
from hidden.superstructure import oscillators
from hidden.trial import Event, Trial, reading, trial
from rich.progress import track
from scipy.signal import resample_poly

from benchmarks.diagnosis import read
from benchmarks.diagnosis_trial import Row, row_of
from benchmarks.table import Table, with_results
from core.arrays import Matrix, Vector

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "models" / "diagnosis.md"
ROWS = ROOT / "build" / "opensees.jsonl"
SEEDS = (11, 13, 17)
"""Laws were added to the library after trials with the seeds 1, 2 and 3."""
NOISE = 0.02
"""Noise of every accelerometer, relative to its root mean square."""
FINE = 10
"""Steps of the integration in one of the records' intervals."""
STOREY_DAMPING = 0.02
"""Damping ratio of the first fixed-base mode by dashpots in the storeys."""
REST = 20.0
"""s between earthquakes in a case whose layer remembers them."""
TIMES, PROCESSES = 1.8, 2
"""Factor on the ground motion where the hidden law slows the layer down; processes at once."""
GROUND, SLAB = 1, 2
"""Nodes; the floors follow the slab."""

Material = tuple[str | float, ...]
"""Name of a uniaxial material in OpenSees, and its arguments after the tag."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Hidden:
    """A change hidden in a layer of rubber, a dashpot and a Bouc-Wen damper."""

    right: tuple[frozenset[str], ...]
    """Effects whose names are right, for each that is hidden."""
    beside: Callable[[Layer], tuple[Material, ...]] = lambda layer: ()
    """Materials in parallel."""
    damper: Callable[[Layer], Material] | None = None
    """The damper in place of the usual one."""
    loss: tuple[float, ...] = (1.0,) * 5
    """Factor of the rubber's stiffness in each earthquake."""
    mass: tuple[float, float] = (0.0, 1.0)
    """Share of the slab's mass that is added on a spring, and its frequency in Hz."""
    remembers: bool = False
    """True if one run has all earthquakes, so that the layer keeps its state."""
    times: float = 1.0
    """Factor on the ground motion."""


def bouc_wen(layer: Layer, exponent: float = 1.0, weaker: float = 0.0) -> Material:
    """The usual damper; `weaker` is by how much each joule increases its degradation."""
    bound, share = 1 / layer.D_y**exponent, layer.beta
    return (
        "BoucWen", 0.0, layer.F_y / layer.D_y, exponent, bound * (1 - share), bound * share, 1.0, 0.0, weaker, weaker,
    )  # fmt: skip


def _effects(*names: str) -> frozenset[str]:
    return frozenset(names)


def _walls(layer: Layer) -> tuple[Material, ...]:
    gap, stiffness = 0.6 * layer.peak, 0.6 * layer.k
    return ("ElasticPPGap", stiffness, 1e12, gap, 0.0), ("ElasticPPGap", stiffness, -1e12, -gap, 0.0)


def _steel(layer: Layer) -> Material:
    return "Steel02", 0.1 * layer.peak_force, 0.1 * layer.peak_force / 0.015, 0.02, 15.0, 0.925, 0.15


def _slider(layer: Layer) -> Material:
    return "ElasticPP", 0.05 * layer.peak_force / 5e-4, 5e-4


def _viscous(layer: Layer, exponent: float, brace: float) -> Material:
    return "ViscousDamper", brace * layer.k, 0.12 * layer.peak_force / layer.speed**exponent, exponent


def _oil(layer: Layer, brace: float) -> Material:
    return "BilinearOilDamper", brace * layer.k, 0.3 * layer.peak_force / layer.speed, 0.07 * layer.peak_force, 0.1


def _cubic(layer: Layer) -> Material:
    at = np.linspace(-3.0, 3.0, 601)
    strains, stresses = at * layer.peak, 0.15 * layer.k * layer.peak * at**3
    return "ElasticMultiLinear", "-strain", *map(float, strains), "-stress", *map(float, stresses)


SHARP = _effects("sharp_hysteresis", "second_hysteresis", "steel_hysteresis", "yield_sharpness")
CASES: Mapping[str, Hidden] = MappingProxyType(
    {
        "nothing": Hidden(right=()),
        "walls": Hidden(right=(_effects("moat"),), beside=_walls),
        "impact": Hidden(
            right=(_effects("moat"),),
            beside=lambda layer: (("ImpactMaterial", layer.k, 0.4 * layer.k, -0.002, -0.6 * layer.peak),),
        ),
        "steel01": Hidden(
            right=(SHARP,),
            beside=lambda layer: (("Steel01", 0.1 * layer.peak_force, 0.1 * layer.peak_force / 0.01, 0.02),),
            times=TIMES,
        ),
        "steel02": Hidden(right=(_effects("steel_hysteresis"),), beside=lambda layer: (_steel(layer),), times=TIMES),
        "steel02_damper": Hidden(
            right=(_effects("steel_hysteresis"),),
            damper=lambda layer: ("Steel02", layer.F_y, layer.F_y / layer.D_y, 0.0, 15.0, 0.925, 0.15),
        ),
        "steel01_damper": Hidden(  # a slider of that slip has the same law
            right=(SHARP | _effects("friction"),),
            damper=lambda layer: ("Steel01", layer.F_y, layer.F_y / layer.D_y, 0.0),
        ),
        "elastic_plastic": Hidden(
            right=(SHARP,),
            beside=lambda layer: (("ElasticPP", 0.1 * layer.peak_force / 0.02, 0.02),),
            times=TIMES,
        ),
        "second_bouc_wen": Hidden(
            right=(_effects("second_hysteresis", "sharp_hysteresis"),),
            beside=lambda layer: (
                ("BoucWen", 0.0, 0.1 * layer.peak_force / 0.02, 1.0, 25.0, 25.0, 1.0, 0.0, 0.0, 0.0),
            ),
            times=TIMES,
        ),
        "slider": Hidden(
            right=(_effects("friction", "breakaway", *SHARP),), beside=lambda layer: (_slider(layer),), times=TIMES
        ),
        "braced_viscous": Hidden(
            right=(_effects("braced_viscous"),), beside=lambda layer: (_viscous(layer, 0.35, 0.5),), times=TIMES
        ),
        "maxwell": Hidden(right=(_effects("maxwell"),), beside=lambda layer: (_viscous(layer, 1.0, 0.4),), times=TIMES),
        "fast_viscous": Hidden(
            right=(_effects("power_viscous", "relief"),),
            beside=lambda layer: (("Viscous", 0.15 * layer.peak_force / layer.speed**1.8, 1.8),),
        ),
        "oil": Hidden(
            right=(_effects("relief", "braced_relief"),), beside=lambda layer: (_oil(layer, 20.0),), times=TIMES
        ),
        "braced_oil": Hidden(right=(_effects("braced_relief"),), beside=lambda layer: (_oil(layer, 1.0),), times=TIMES),
        "flag": Hidden(
            right=(_effects("flag_shape", "self_centring"),),
            beside=lambda layer: (
                ("SelfCentering", 0.1 * layer.peak_force / 0.003, 0.02 * layer.k, 0.1 * layer.peak_force, 0.7),
            ),
            times=TIMES,
        ),
        "degrading": Hidden(
            right=(_effects("degradation", "strength_degradation", "stiffness_degradation"),),
            damper=lambda layer: bouc_wen(layer, weaker=0.6 / (20 * layer.F_y * layer.peak)),
            remembers=True,
        ),
        "sharpness_2": Hidden(right=(_effects("yield_sharpness"),), damper=lambda layer: bouc_wen(layer, 2.0)),
        "sharpness_5": Hidden(right=(_effects("yield_sharpness"),), damper=lambda layer: bouc_wen(layer, 5.0)),
        "cubic": Hidden(right=(_effects("hardening"),), beside=lambda layer: (_cubic(layer),)),
        "one_side": Hidden(
            right=(_effects("asymmetry"),), beside=lambda layer: (("Elastic", 0.1 * layer.k, 0.0, 0.02 * layer.k),)
        ),
        "loss": Hidden(right=(_effects("stiffness_step"),), loss=(1.0, 1.0, 0.9, 0.9, 0.9)),
        "mass": Hidden(right=(_effects("tuned_mass"),), mass=(0.06, 1.5)),
        "walls+slider": Hidden(
            right=(_effects("moat"), _effects("friction")),
            beside=lambda layer: (*_walls(layer), _slider(layer)),
            times=2 * TIMES,
        ),
        "braced_viscous+cubic": Hidden(
            right=(_effects("braced_viscous"), _effects("hardening")),
            beside=lambda layer: (_viscous(layer, 0.35, 0.5), _cubic(layer)),
            times=TIMES,
        ),
        "steel02+oil": Hidden(
            right=(_effects("steel_hysteresis"), _effects("relief", "braced_relief")),
            beside=lambda layer: (_steel(layer), _oil(layer, 20.0)),
            times=TIMES,
        ),
        "mass+cubic": Hidden(
            right=(_effects("tuned_mass"), _effects("hardening")),
            beside=lambda layer: (_cubic(layer),),
            mass=(0.06, 1.5),
        ),
    }
)


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Response at the records' samples."""

    displacement: Vector
    velocity: Vector
    acceleration: Matrix
    """(1 + floors, n) m/s², absolute, the base slab first."""
    force: Vector
    """(n,) N, by the masses of the building file."""


def simulated(made: Trial, hidden: Hidden, ground: Vector, stiffness: float) -> Motion:
    """Response of a trial's building to a ground motion at the records' rate, along x.

    Raises:
        ArithmeticError: OpenSees found no equilibrium.
    """
    ops = import_module("openseespy.opensees")
    fine = resample_poly(ground, FINE, 1)
    step, structure = 1 / (FINE * RATE), made.building.superstructure
    _assemble(ops, made, hidden, stiffness)
    ops.timeSeries("Path", 1, "-dt", step, "-values", *map(float, fine))
    ops.pattern("UniformExcitation", 1, 1, "-accel", 1)
    for command in ("constraints", "Plain"), ("numberer", "RCM"), ("system", "BandGeneral"), ("algorithm", "Newton"):
        getattr(ops, command[0])(command[1])
    ops.test("NormUnbalance", 1.0, 60)
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient")
    nodes = range(SLAB, SLAB + 1 + structure.floor_mass.size)
    moved, speed, rows = np.zeros(fine.size), np.zeros(fine.size), np.zeros((len(nodes), fine.size))
    for now in range(1, fine.size):
        if ops.analyze(1, step) != 0:
            _in_pieces(ops, step, now)
        moved[now], speed[now] = ops.nodeDisp(SLAB, 1), ops.nodeVel(SLAB, 1)
        rows[:, now] = [ops.nodeAccel(node, 1) for node in nodes]
    rows += fine
    force = -(structure.base_mass * rows[0] + structure.floor_mass @ rows[1:])
    return Motion(*(sampled(one, FINE * RATE) for one in (moved, speed, rows, force)))


def _in_pieces(ops: Any, step: float, now: int) -> None:  # noqa: ANN401  a module
    """One step in ten, by other algorithms."""
    for algorithm in ("KrylovNewton", "ModifiedNewton", "NewtonLineSearch"):
        ops.algorithm(algorithm)
        if ops.analyze(10, step / 10) == 0:
            ops.algorithm("Newton")
            return
    raise ArithmeticError(f"OpenSees found no equilibrium in step {now}")


def _assemble(ops: Any, made: Trial, hidden: Hidden, stiffness: float) -> None:  # noqa: ANN401  a module
    """The shear building on its layer, in OpenSees."""
    structure, layer = made.building.superstructure, made.building.layer
    ops.wipe()
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    ops.node(GROUND, 0.0)
    ops.fix(GROUND, 1)
    for node, mass in enumerate((structure.base_mass, *structure.floor_mass), SLAB):
        ops.node(node, 0.0, "-mass", float(mass))
    lowest = float(np.sqrt(-oscillators(structure, 1 / RATE).answer[0, 0]))
    for node, k in enumerate(structure.storey_stiffness, SLAB):
        _join(ops, node, node, node + 1, ("Elastic", k, 2 * STOREY_DAMPING / lowest * k))
    damper = bouc_wen(layer) if hidden.damper is None else hidden.damper(layer)
    usual: tuple[Material, ...] = (("Elastic", stiffness * layer.k), ("Viscous", layer.c, 1.0), damper)
    for tag, material in enumerate((*usual, *hidden.beside(layer)), 100):
        _join(ops, tag, GROUND, SLAB, material)
    share, frequency = hidden.mass
    if share:
        mass, omega = share * structure.base_mass, 2 * np.pi * frequency
        ops.node(200, 0.0, "-mass", mass)
        _join(ops, 200, SLAB, 200, ("Elastic", mass * omega**2, 0.06 * mass * omega))


def _join(ops: Any, tag: int, one: int, other: int, material: Material) -> None:  # noqa: ANN401  a module
    name, *arguments = material
    ops.uniaxialMaterial(name, tag, *(one if isinstance(one, str) else float(one) for one in arguments))
    ops.element("zeroLength", tag, one, other, "-mat", tag, "-dir", 1, "-doRayleigh", 0)


def opensees_trial(case: str, seed: int) -> Trial:
    """The buildings, motions and sensors of a trial in which nothing is hidden, moved by OpenSees."""
    made, hidden = trial("nothing", seed), CASES[case]
    motions = [hidden.times * event.ground[0] for event in made.events]
    if hidden.remembers:
        rest = np.zeros(round(REST * RATE))
        whole = simulated(made, hidden, np.concatenate([one for motion in motions for one in (motion, rest)]), 1.0)
        ends = np.cumsum([motion.size + rest.size for motion in motions])
        found = [
            Motion(*(series[..., end - rest.size - motion.size : end - rest.size] for series in _series(whole)))
            for end, motion in zip(ends, motions, strict=True)
        ]
    else:
        found = [simulated(made, hidden, motion, left) for motion, left in zip(motions, hidden.loss, strict=True)]
    noisy, rng = Noise(NOISE), np.random.default_rng([seed, *case.encode()])
    events = tuple(
        _recorded(made, replace(event, ground=np.vstack([motion, event.ground[1:]])), one, noisy, rng)
        for event, motion, one in zip(made.events, motions, found, strict=True)
    )
    return replace(made, case=case, noise=noisy, events=events)


def _series(motion: Motion) -> Iterator[Any]:
    yield from (motion.displacement, motion.velocity, motion.acceleration, motion.force)


def _recorded(made: Trial, event: Event, motion: Motion, noisy: Noise, rng: np.random.Generator) -> Event:
    exact = replace(
        event,
        displacement=np.vstack([motion.displacement, event.displacement[1:]]),
        velocity=np.vstack([motion.velocity, event.velocity[1:]]),
        force=np.vstack([motion.force, event.force[1:]]),
        acceleration=np.concatenate([motion.acceleration[None], event.acceleration[1:]]),
    )
    channels = made.description.channels
    samples = np.array([reading(channel, exact, noisy, rng) for channel in channels])
    return replace(exact, record=replace(event.record, channels=channels, samples=samples))


def opensees_row(case: str, seed: int) -> Row:
    """The trial of a case and seed, diagnosed."""
    return row_of(opensees_trial(case, seed))


def verdict(row: Row) -> str:
    """Verdict on the diagnosis of a trial, in words."""
    right = CASES[row.case].right
    if row.suspects:
        return "wrong"
    if not right:
        return "wrong" if row.named or row.unknown else "right"
    if not row.named:
        return "unknown"
    if not all(any(set(one) & meant for meant in right) for one in row.sets):
        return "wrong"
    if not all(any(set(one) & meant for one in row.sets) for meant in right):
        return "in part, and said so" if row.unknown else "wrong"
    return "right" if all(len(one) == 1 for one in row.sets) else "in a set"


def table(rows: list[Row]) -> Table:
    """Every trial."""
    return Table(
        "Layers that OpenSees simulates",
        f"{len(rows)} trials with the seeds {', '.join(map(str, SEEDS))}, noise of {100 * NOISE:g} % in every "
        f"accelerometer. {_counts(rows)}",
        ("hidden", "seed", "noise ratio before", "after", "outcome", ""),
        tuple(
            (
                row.case,
                str(row.seed),
                f"{row.before:.1f}",
                f"{row.after:.2f}",
                " and ".join(" or ".join(one) for one in row.sets) or row.outcome.replace("_", " "),
                verdict(row),
            )
            for row in sorted(rows, key=lambda one: (list(CASES).index(one.case), one.seed))
        ),
    )


def _counts(rows: list[Row]) -> str:
    found = [verdict(row) for row in rows]
    return "; ".join(f"{found.count(one)} {one}" for one in dict.fromkeys(sorted(found))) + "."


def main() -> None:
    """Run what is missing, and write the page."""
    parser = ArgumentParser(prog="python -m benchmarks.opensees", description=__doc__.splitlines()[0])
    parser.add_argument("--only", choices=sorted(CASES), help="this case, onto the screen")
    parser.add_argument("--rows", type=Path, default=ROWS, help="where the trials are kept")
    given = parser.parse_args()
    cases = [given.only] if given.only else list(CASES)
    given.rows.parent.mkdir(parents=True, exist_ok=True)
    there = {(one.case, one.seed) for one in read(given.rows)}
    missing = [(case, seed) for seed in SEEDS for case in cases if (case, seed) not in there]
    with ProcessPoolExecutor(PROCESSES, get_context("spawn")) as pool, given.rows.open("a", encoding="utf-8") as lines:
        waiting = [pool.submit(opensees_row, *one) for one in missing]
        for done in track(as_completed(waiting), "diagnosing", total=len(missing)):
            lines.write(json.dumps(asdict(done.result())) + "\n")
            lines.flush()
    text = table([one for one in read(given.rows) if one.seed in SEEDS and one.case in cases]).markdown()
    if given.only:
        print(text)
        return
    PAGE.write_text(with_results(PAGE.read_text("utf-8"), "benchmarks.opensees", text), "utf-8")
    print(PAGE)


if __name__ == "__main__":
    main()
