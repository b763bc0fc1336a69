"""Records that models are fitted to, and the derivatives of a model's force by each parameter, whitened.

The effects of a model form independent groups: an effect that scales others, or reads the hysteretic variable, shares a
group with them. Each group's force is computed alone, once for each choice of its nonlinear parameters.
"""

from collections import OrderedDict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import accumulate, pairwise
from threading import Lock

import numpy as np

from core.arrays import Matrix, Vector
from core.effect import KINDS, RESULTS, YIELDED
from core.effects import EFFECTS
from core.fitting.noise import force_noise
from core.fitting.observation import Observation
from core.model.force_response import (
    Excitation,
    excitation,
    force_derivatives,
    parameter_directions,
    state_history,
)
from core.model.isolator import Isolator, Key, PackedModel, are_carried, packed
from core.record import Direction
from core.signals.whitening import Whitening

KEPT = 2e8
"""Bytes of columns that are kept, those used last."""
KEPT_STATES = 2e7
"""Bytes of states that are kept: a search needs them again for the derivatives where its last step ended. A choice."""


class BoundedMemory:
    """Bounded cache of matrices during a search."""

    def __init__(self, room: float) -> None:
        """Cache of so many bytes."""
        self._kept: OrderedDict[tuple[object, ...], Matrix] = OrderedDict()
        self._bytes = 0
        self._room = room
        self._lock = Lock()

    @property
    def size(self) -> int:
        """Bytes in the cache."""
        return self._bytes

    def of(self, key: tuple[object, ...], compute: Callable[[], Matrix]) -> Matrix:
        """Matrix of a key, computed unless it is in the cache."""
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
                return self._kept[key]
        columns = compute()
        with self._lock:
            if key not in self._kept:
                self._kept[key] = columns
                self._bytes += columns.nbytes
            while self._bytes > self._room and len(self._kept) > 1:
                self._bytes -= self._kept.popitem(last=False)[1].nbytes
        return columns

    def clear(self) -> None:
        """Empty the cache, so that results which refer to it stay small."""
        with self._lock:
            self._kept.clear()
            self._bytes = 0


class ColumnMemory(BoundedMemory):
    """Cache of columns, and of the states that they were computed from.

    Copies and pickles of an object that refers to it start with an empty cache.
    """

    def __init__(self) -> None:
        super().__init__(KEPT)
        self.states = BoundedMemory(KEPT_STATES)

    def __reduce__(self) -> tuple[type["ColumnMemory"], tuple[()]]:
        return ColumnMemory, ()

    @property
    def size(self) -> int:
        """Bytes in both caches."""
        return super().size + self.states.size

    def clear(self) -> None:
        """Empty both caches."""
        super().clear()
        self.states.clear()


def groups(names: Iterable[str]) -> tuple[tuple[str, ...], ...]:
    """Effects in independent groups."""
    apart: list[set[str]] = []
    for name in sorted(names):
        joined = [group for group in apart if any(_coupled(name, other) for other in group)]
        apart = [group for group in apart if group not in joined] + [{name}.union(*joined)]
    return tuple(sorted(tuple(sorted(group)) for group in apart))


def _coupled(one: str, other: str) -> bool:
    return _heeds(one, other) or _heeds(other, one)


def _heeds(reader: str, other: str) -> bool:
    """True if one effect reads, or is scaled by, a channel or state that the other sets."""
    reading, acting = EFFECTS[reader], EFFECTS[other]
    if acting.publishes is not None and YIELDED in reading.needs:
        return True
    scales = KINDS[reading.kind] if reading.kind else ()
    return acting.acts_on not in RESULTS and acting.acts_on in (*reading.needs, *scales)


@dataclass(frozen=True, slots=True, eq=False)
class FitData:
    """Records in the order of their times, with the whitened force."""

    observations: tuple[Observation, ...]
    excitations: tuple[Excitation, ...]
    """Prescribed motion of each observation."""
    whitenings: tuple[Whitening, ...]
    target: Vector
    """(m,) whitened measured forces, one record after the other."""
    memory: ColumnMemory = field(default_factory=ColumnMemory, repr=False)
    """Cache of columns in N before whitening, which do not depend on the weights."""

    @classmethod
    def by_noise(cls, observations: Sequence[Observation]) -> "FitData":
        """Data weighted by the errors of the measured force and of the motion."""
        seen = tuple(observations)
        excitations = tuple(excitation(o.layer.displacement, o.layer.velocity, o.rate, o.conditions) for o in seen)
        return cls(seen, excitations, (), np.zeros(0)).weighed([force_noise(one).whitening for one in seen])

    def weighed(self, whitenings: Sequence[Whitening]) -> "FitData":
        """The same records with other weights."""
        white = [w.of(o.layer.force[None])[0] for o, w in zip(self.observations, whitenings, strict=True)]
        return replace(self, whitenings=tuple(whitenings), target=np.concatenate(white))

    @property
    def spans(self) -> tuple[slice, ...]:
        """Span of each record in the target."""
        return _spans(w.std.size for w in self.whitenings)


def _spans(sizes: Iterable[int]) -> tuple[slice, ...]:
    return tuple(slice(a, b) for a, b in pairwise(accumulate(sizes, initial=0)))


def columns(data: FitData, model: Isolator, wanted: Sequence[Key]) -> Matrix:
    """(wanted, m) exact derivatives of the whitened force by parameters of one group, at the model's values.

    By a parameter that the force is proportional to, that is the force for 1 of its unit.

    Args:
        data: the records.
        model: one group's effects and values.
        wanted: which parameters.
    """
    values = tuple((name, *values.values()) for name, values in model.effects.items())
    known = data.memory.of((tuple(wanted), *values), lambda: _columns(data, model, wanted, values))
    spans = zip(data.spans, data.whitenings, strict=True)
    return np.concatenate([weights.whitened(known[:, span]) for span, weights in spans], axis=1)


def _columns(data: FitData, isolator: Isolator, wanted: Sequence[Key], values: tuple[object, ...]) -> Matrix:
    matrices: list[Matrix] = []
    model, kept = packed(isolator), are_carried(isolator)
    followed = data.memory.states.of(values, lambda: _states(data, isolator, model))
    towards = parameter_directions(model, isolator, wanted)
    last: dict[Direction, Matrix] = {}
    spans = _spans(one.acceleration.size for one in data.excitations)
    each = zip(data.observations, data.excitations, data.whitenings, spans, strict=True)
    for observation, excited, weights, span in each:
        before = last.get(observation.direction, np.zeros((len(wanted), model.states)))
        changes = np.where(kept, before, 0.0)
        columns, last[observation.direction] = force_derivatives(excited, model, towards, followed[span], changes)
        matrices.append(weights.filtered(columns))
    return np.concatenate(matrices, axis=1)


def _states(data: FitData, isolator: Isolator, model: PackedModel) -> Matrix:
    """(samples, states) of a model in all records, from one to the next of a direction."""
    histories: list[Matrix] = []
    last: dict[Direction, Vector] = {}
    kept = are_carried(isolator)
    for observation, excited in zip(data.observations, data.excitations, strict=True):
        start = np.where(kept, last.get(observation.direction, np.zeros(model.states)), 0.0)
        histories.append(state_history(excited, model, start))
        last[observation.direction] = histories[-1][-1]
    return np.concatenate(histories)
