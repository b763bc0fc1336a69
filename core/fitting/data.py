"""Records that models are fitted to, and the derivatives of a model's force by each parameter, whitened.

The effects of a model form independent groups: an effect that scales others, or reads the hysteretic variable, shares a
group with them. Each group's force is computed alone, once for each choice of its nonlinear parameters.
"""

from collections import OrderedDict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from itertools import accumulate, chain, pairwise
from threading import Lock
from typing import Generic, Protocol, TypeVar

import numpy as np

from core.arrays import Matrix, Vector
from core.effect import KINDS, RESULTS, YIELDED, Effect
from core.effects import EFFECTS, Laws
from core.fitting.noise import force_noise
from core.fitting.observation import Observation, excitation_by
from core.model.force_response import (
    Excitation,
    StateHistory,
    force_derivatives,
    parameter_directions,
    state_history,
)
from core.model.isolator import Isolator, Key, are_carried, packed
from core.record import Direction
from core.signals.whitening import Whitening

KEPT = 2e8
"""Bytes of columns that are kept, those used last."""
KEPT_STATES = 2e7
"""Bytes of states that are kept: a search needs them again for the derivatives where its last step ended. A choice."""

AT_ONCE = 32
"""Models whose columns are transformed together. A choice, for the memory that their histories need."""


class Sized(Protocol):
    """An object that occupies memory."""

    @property
    def nbytes(self) -> int:
        """Bytes."""


Kept = TypeVar("Kept", bound=Sized)


class BoundedMemory(Generic[Kept]):
    """Bounded cache of arrays during a search."""

    def __init__(self, room: float) -> None:
        """Cache of so many bytes."""
        self._kept: OrderedDict[tuple[object, ...], Kept] = OrderedDict()
        self._bytes = 0
        self._room = room
        self._lock = Lock()

    @property
    def size(self) -> int:
        """Bytes in the cache."""
        return self._bytes

    def of(self, key: tuple[object, ...], compute: Callable[[], Kept]) -> Kept:
        """Arrays of a key, computed unless they are in the cache."""
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
                return self._kept[key]
        made = compute()
        with self._lock:
            if key not in self._kept:
                self._kept[key] = made
                self._bytes += made.nbytes
            while self._bytes > self._room and len(self._kept) > 1:
                self._bytes -= self._kept.popitem(last=False)[1].nbytes
        return made

    def __contains__(self, key: tuple[object, ...]) -> bool:
        with self._lock:
            return key in self._kept

    def clear(self) -> None:
        """Empty the cache, so that results which refer to it stay small."""
        with self._lock:
            self._kept.clear()
            self._bytes = 0


class ColumnMemory(BoundedMemory[Matrix]):
    """Cache of columns, and of the states that they were computed from.

    Copies and pickles of an object that refers to it start with an empty cache.
    """

    def __init__(self) -> None:
        super().__init__(KEPT)
        self.states: BoundedMemory[StateHistory] = BoundedMemory(KEPT_STATES)

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
    return _groups(tuple((name, EFFECTS[name]) for name in sorted(names)))


@lru_cache(256)  # every evaluation of a model asks, and a diagnosis has about a hundred models
def _groups(effects: Laws) -> tuple[tuple[str, ...], ...]:
    apart: list[Laws] = []
    for one in effects:
        joined = [group for group in apart if any(_coupled(one[1], other) for _, other in group)]
        apart = [group for group in apart if group not in joined] + [(one, *chain.from_iterable(joined))]
    return tuple(sorted(tuple(sorted(name for name, _ in group)) for group in apart))


def _coupled(one: Effect, other: Effect) -> bool:
    return _heeds(one, other) or _heeds(other, one)


def _heeds(reading: Effect, acting: Effect) -> bool:
    """True if one effect reads, or is scaled by, a channel or state that the other sets."""
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
        unweighed = cls(seen, tuple(excitation_by(one) for one in seen), (), np.zeros(0))
        return unweighed.weighed([force_noise(one).whitening for one in seen])

    def weighed(self, whitenings: Sequence[Whitening]) -> "FitData":
        """The same records with other weights."""
        white = [w.of(o.layer.force[None])[0] for o, w in zip(self.observations, whitenings, strict=True)]
        return replace(self, whitenings=tuple(whitenings), target=np.concatenate(white))

    def whitened(self, coefficients: Matrix) -> Matrix:
        """(k, m) independent units of the noise, of (k, m) coefficients in N, one record after the other."""
        white = np.empty_like(coefficients)
        for span, weights in zip(self.spans, self.whitenings, strict=True):
            white[:, span] = weights.whitened(coefficients[:, span])
        return white

    @property
    def spans(self) -> tuple[slice, ...]:
        """Span of each record in the target."""
        return _spans(w.std.size for w in self.whitenings)


def _spans(sizes: Iterable[int]) -> tuple[slice, ...]:
    return tuple(slice(a, b) for a, b in pairwise(accumulate(sizes, initial=0)))


Wanted = tuple[Isolator, tuple[Key, ...]]
"""One group's effects and values, and the parameters by which its force is differentiated."""


def columns(data: FitData, model: Isolator, wanted: Sequence[Key]) -> Matrix:
    """(wanted, m) N, exact derivatives of the force's coefficients by parameters of one group, at the model's values.

    By a parameter that the force is proportional to, that is the force for 1 of its unit.

    Args:
        data: the records.
        model: one group's effects and values.
        wanted: which parameters.
    """
    one = model, tuple(wanted)
    return data.memory.of(_name(one), lambda: _columns(data, [one])[0])


def compute_columns(data: FitData, asked: Iterable[Wanted]) -> None:
    """Compute those of these columns that are not in the cache, many at a time.

    Args:
        data: the records.
        asked: as the arguments of `columns`.
    """
    missing = [one for name, one in {_name(one): one for one in asked}.items() if name not in data.memory]
    for first in range(0, len(missing), AT_ONCE):
        batch = missing[first : first + AT_ONCE]
        for one, made in zip(batch, _columns(data, batch), strict=True):
            data.memory.of(_name(one), partial(np.asarray, made))


def _name(one: Wanted) -> tuple[object, ...]:
    model, wanted = one
    return (wanted, *((name, *values.values()) for name, values in model.effects.items()))


def _columns(data: FitData, asked: Sequence[Wanted]) -> list[Matrix]:
    models = [packed(isolator) for isolator, _ in asked]
    kept = [are_carried(isolator) for isolator, _ in asked]
    followed = [_states(data, isolator) for isolator, _ in asked]
    towards = [parameter_directions(model, *one) for model, one in zip(models, asked, strict=True)]
    last: list[dict[Direction, Matrix]] = [{} for _ in asked]
    spans = _spans(one.acceleration.size for one in data.excitations)
    rows = _spans(len(wanted) for _, wanted in asked)
    filtered = np.empty((rows[-1].stop, sum(w.std.size for w in data.whitenings)))
    each = zip(data.observations, data.excitations, data.whitenings, spans, data.spans, strict=True)
    for observation, excited, weights, span, coefficients in each:
        series = np.empty((rows[-1].stop, excited.acceleration.size))
        for n, model in enumerate(models):
            before = last[n].get(observation.direction, np.zeros((len(towards[n]), model.states)))
            changes = np.where(kept[n], before, 0.0)
            answer = force_derivatives(excited, model, towards[n], followed[n][span], changes)
            series[rows[n]], last[n][observation.direction] = answer
        filtered[:, coefficients] = weights.filtered(series)
    return [filtered[row] if len(asked) == 1 else filtered[row].copy() for row in rows]


def _states(data: FitData, isolator: Isolator) -> StateHistory:
    """States of a model in all records, from one to the next of a direction."""
    driving = Isolator({name: isolator.effects[name] for name in driving_states(isolator.effects)})
    return data.memory.states.of(_state_name(driving), lambda: _followed(data, driving))


def driving_states(names: Iterable[str]) -> tuple[str, ...]:
    """Effects of a group on which its states depend: those with states, and those that set what these laws read.

    A scale that multiplies a force alone changes no state.
    """
    every = tuple(names)
    found = [name for name in every if EFFECTS[name].states]
    for name in found:
        read = EFFECTS[name].needs
        found += [one for one in every if one not in found and EFFECTS[one].acts_on in read]
    return tuple(name for name in every if name in found)


def _state_name(driving: Isolator) -> tuple[object, ...]:
    """Effects and all their values but those of parameters on which no state depends."""
    amplitudes = {name: EFFECTS[name].linear if EFFECTS[name].acts_on in RESULTS else () for name in driving.effects}
    return tuple(
        (name, *(value for key, value in values.items() if key not in amplitudes[name]))
        for name, values in driving.effects.items()
    )


def _followed(data: FitData, isolator: Isolator) -> StateHistory:
    histories: list[StateHistory] = []
    last: dict[Direction, Vector] = {}
    model, kept = packed(isolator), are_carried(isolator)
    for observation, excited in zip(data.observations, data.excitations, strict=True):
        start = np.where(kept, last.get(observation.direction, np.zeros(model.states)), 0.0)
        histories.append(state_history(excited, model, start))
        last[observation.direction] = histories[-1].states[-1]
    states, steps = (np.concatenate(each) for each in zip(*((one.states, one.steps) for one in histories), strict=True))
    return StateHistory(states, steps)
