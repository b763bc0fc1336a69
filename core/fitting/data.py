"""What does each parameter of a model do to the force, in every record?

A model falls apart into groups of effects that know nothing of each other: one acts on a scale that another reads, or
reads the hysteretic variable that another publishes, within a group only. Each group's force is computed by itself,
once for each choice of its nonlinear parameters.
"""

from collections import OrderedDict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from threading import Lock

import numpy as np

from core.arrays import Matrix, Vector
from core.effect import RESULTS, YIELDED
from core.effects import EFFECTS
from core.estimators.result import fused_displacement_error, white
from core.fitting.observation import LayerHistory, Observation
from core.model.force_response import Excitation, ForceResponse, excitation, response_to
from core.model.isolator import Isolator, Key, carried
from core.record import Direction
from core.signals.whitening import BAND, Whitening, shrunk, whitening

KEPT = 2e8
"""Bytes of columns that are remembered: those used last."""


class ColumnMemory:
    """Columns of effects that were computed before, while something is searched for: bounded, and no part of a value.

    Copies and pickles of what refers to it begin with an empty one.
    """

    def __init__(self) -> None:
        self._kept: OrderedDict[tuple[object, ...], Matrix] = OrderedDict()
        self._bytes = 0
        self._lock = Lock()

    def __reduce__(self) -> tuple[type["ColumnMemory"], tuple[()]]:
        return ColumnMemory, ()

    @property
    def size(self) -> int:
        """Bytes that are remembered."""
        return self._bytes

    def of(self, key: tuple[object, ...], compute: Callable[[], Matrix]) -> Matrix:
        """The columns of a key, computed if they are not remembered."""
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
                return self._kept[key]
        found = compute()
        with self._lock:
            if key not in self._kept:
                self._kept[key] = found
                self._bytes += found.nbytes
            while self._bytes > KEPT and len(self._kept) > 1:
                self._bytes -= self._kept.popitem(last=False)[1].nbytes
        return found

    def clear(self) -> None:
        """Forget all: a result that refers to it then holds nothing but itself."""
        with self._lock:
            self._kept.clear()
            self._bytes = 0


def groups(names: Iterable[str]) -> tuple[tuple[str, ...], ...]:
    """The effects in groups that know nothing of each other."""
    apart: list[set[str]] = []
    for name in sorted(names):
        joined = [group for group in apart if any(_coupled(name, other) for other in group)]
        apart = [group for group in apart if group not in joined] + [{name}.union(*joined)]
    return tuple(sorted(tuple(sorted(group)) for group in apart))


def _coupled(one: str, other: str) -> bool:
    return _heeds(one, other) or _heeds(other, one)


def _heeds(reader: str, other: str) -> bool:
    """Whether the one reads what the other says."""
    needs, said = EFFECTS[reader].needs, EFFECTS[other]
    return (said.acts_on not in RESULTS and said.acts_on in needs) or (said.publishes is not None and YIELDED in needs)


@dataclass(frozen=True, slots=True, eq=False)
class FitData:
    """The records that a model is fitted to, in the order of their times, the force whitened."""

    observations: tuple[Observation, ...]
    excitations: tuple[Excitation, ...]
    """Prescribed motion of each observation."""
    whitenings: tuple[Whitening, ...]
    target: Vector
    """(m,) the measured forces, one record's coefficients after the other's."""
    memory: ColumnMemory = field(default_factory=ColumnMemory, repr=False)
    """Of columns in N, not yet over the noise: the same however the records are weighed."""

    @classmethod
    def by_noise(cls, observations: Sequence[Observation]) -> "FitData":
        """Weighed by what is uncertain of the measured force, and of the motion that drives a model."""
        seen = tuple(observations)
        excitations = tuple(excitation(o.layer.displacement, o.layer.velocity, o.rate, o.conditions) for o in seen)
        return cls(seen, excitations, (), np.zeros(0)).weighed([_whitening(one) for one in seen])

    def weighed(self, whitenings: Sequence[Whitening]) -> "FitData":
        """The same records by other noise."""
        white = [w.of(o.layer.force[None])[0] for o, w in zip(self.observations, whitenings, strict=True)]
        return replace(self, whitenings=tuple(whitenings), target=np.concatenate(white))

    @property
    def spans(self) -> tuple[slice, ...]:
        """Of each record's coefficients."""
        ends = np.cumsum([0, *(w.std.size for w in self.whitenings)])
        return tuple(slice(int(a), int(b)) for a, b in pairwise(ends))


def _whitening(observation: Observation) -> Whitening:
    """By the error of the measured force, and of the motion that drives a model."""
    layer = observation.layer
    error, motion = layer.force_error or white(layer.force_std, BAND), _by_motion(layer)
    weights = whitening(
        layer.force,
        observation.rate,
        lambda f: error.at(f) + motion(f),
        patterns=error.patterns if error.patterns.size else None,
        passed=layer.band,
        window=edge_taper(layer.force, observation.rate),
    )
    return shrunk(weights, layer.force, error.at) if error.is_shrunk else weights


def _by_motion(layer: LayerHistory) -> Callable[[Vector], Vector]:
    """N²/Hz at frequencies in Hz, error of a model's force by that of the motion that drives it."""
    travel = float(np.linalg.norm(np.diff(layer.displacement)))
    if layer.displacement_std is None or layer.velocity_std is None or travel == 0:
        return np.zeros_like
    stiffness = float(np.linalg.norm(np.diff(layer.force))) / travel
    motion = fused_displacement_error(float(np.median(layer.displacement_std)), float(np.median(layer.velocity_std)))
    return lambda frequency: np.asarray(stiffness**2 * motion.at(frequency))


def columns(data: FitData, model: Isolator, wanted: Sequence[Key]) -> Matrix:
    """(wanted, m) exact derivatives of the whitened force by parameters of one group, at the model's values.

    By a parameter that the force is proportional to, that is the force for 1 of its unit.

    Args:
        data: the records.
        model: one group's effects and values.
        wanted: which parameters.
    """
    key = (tuple(wanted), *((name, *values.values()) for name, values in model.effects.items()))
    known = data.memory.of(key, lambda: _columns(data, model, wanted))
    spans = zip(data.spans, data.whitenings, strict=True)
    return np.concatenate([weights.whitened(known[:, span]) for span, weights in spans], axis=1)


def _columns(data: FitData, model: Isolator, wanted: Sequence[Key]) -> Matrix:
    found: list[Matrix] = []
    last: dict[Direction, ForceResponse] = {}
    each = zip(data.observations, data.excitations, data.whitenings, strict=True)
    for observation, excited, weights in each:
        before = last.get(observation.direction)
        now = last[observation.direction] = response_to(
            excited,
            model,
            wanted=wanted,
            states=None if before is None else carried(model, before.states),
            states_by_parameter=None if before is None else carried(model, before.states_by_parameter),
        )
        found.append(weights.filtered(now.by_parameter))
    return np.concatenate(found, axis=1)


EDGE = 0.5
"""s, of the record at either end."""
AT_REST = 0.01
"""Of the strongest EDGE: an end that is weaker is taken to be at rest."""
IGNORED, FADED = 5.0, 15.0
"""s from an end in motion: up to the one nothing is relied on, from the other on everything; in simulated records the
force there errs by up to 13 %, 2 % and 0.5 % of its root mean square in the first, second and third five seconds."""
LONGEST = 0.25
"""Of the record, that is lost so at either end."""


def edge_taper(force: Vector, rate: float) -> Vector:
    """(n,) from 0 to 1; 1 everywhere for a record that begins and ends at rest.

    Args:
        force: (n,) N.
        rate: Hz.
    """
    window, count = np.ones(force.size), max(1, round(EDGE * rate))
    power = np.convolve(force**2, np.full(count, 1 / count), mode="valid")
    ignored, faded = (min(1.0, LONGEST * force.size / rate / FADED) * one for one in (IGNORED, FADED))
    along = np.clip((np.arange(force.size) / rate - ignored) / (faded - ignored), 0, 1)
    rising = np.sin(np.pi / 2 * along) ** 2
    for end, shape in ((power[0], rising), (power[-1], rising[::-1])):
        if end > AT_REST**2 * power.max():
            window *= shape
    return window
