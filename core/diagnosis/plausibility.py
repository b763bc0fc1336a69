"""Plausibility of an effect with its fitted values.

An effect is impossible where it has no strength, makes the layer feed energy into the motion, or is what wrong masses
of the building make of the estimated force. It is doubtful where a value is at the end of its range, or is not
determined: its law is then probably wrong. It is doubtful, too, where a simpler law is sufficient, or where it depends
on what no record has. Both are shown with their reason; neither is named where records do not distinguish a plausible
effect from it, and an impossible one never is. Where no law is quite right, a doubtful one may be meant
(core.diagnosis.missing_effects).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import log

import numpy as np

from core.arrays import Matrix, Vector
from core.diagnosis.candidate_search import is_excited, unusual_length, unusual_speed
from core.effects import EFFECTS
from core.fitting.data import FitData
from core.fitting.fit import Fit, tangents
from core.fitting.observation import Observation, excitation_by
from core.fitting.search import Outcome
from core.model.force_response import response_to
from core.model.isolator import Isolator, Key, parameter

CERTAIN = 3.0
"""Standard deviations by which a value must differ from one at which the law is a simpler one. A choice."""
FED = 0.05
"""Energy that numerical errors may feed into the motion, as a share of the layer's work. A choice."""
SAME = 0.97
"""Correlation of a mass's whitened force with what wrong masses can make, from which on it may be that,"""
APART = 0.5
"""and power of the rest, which neither they nor the model's other parameters make, over the noise's, from which on it
is not. Both chosen on even seeds of benchmarks.diagnosis, where the correlation is 0.984 to 1.000 if masses are wrong.
On the odd seeds 7, 13, 23 and 27 of its trials with wrong floor masses the rest is 0.02 to 0.29; with one or two masses
on springs, on the seeds 1, 3, 7 and 9, it is 1.8 to 8.4. Seeds 7 and 13 showed that one mode alone is too little to
compare with."""
RIGID = {"mass": 1.0, "frequency": 29.0, "damping": 0.7}
"""Values of a mass on a spring at which it moves with the slab, its frequency near the end of its range."""
ALIKE = 1e-6
"""Smallest singular value, relative to the largest, of forces that are not alike. A choice."""


@dataclass(frozen=True, slots=True)
class Objection:
    """An objection to an effect."""

    reason: str
    """In words."""
    is_impossible: bool
    """Or it is doubtful only."""


def objection(effect: str, fit: Fit, observations: Sequence[Observation]) -> Objection | None:
    """Strongest objection to an effect; None if there is none.

    Args:
        effect: of the model.
        fit: of the model with it.
        observations: the records.
    """
    about, values = EFFECTS[effect], fit.model.effects[effect]
    if about.linear and all(values[name] == 0 for name in about.linear):
        return Objection("it has no strength left: the records support its opposite", is_impossible=True)
    fed = [one for one in observations if _work(fit.model, one) < 0]
    if fed:
        reason = f"the layer would feed energy into the motion in the earthquake of {fed[0].name}"
        return Objection(reason, is_impossible=True)
    same = _of_wrong_masses(effect, fit, observations)
    if same is not None:
        return Objection(same, is_impossible=True)
    doubt = next(_doubts(effect, fit, observations), None)
    return None if doubt is None else Objection(doubt, is_impossible=False)


def implausible(effect: str, fit: Fit, observations: Sequence[Observation]) -> str | None:
    """The same, its reason alone."""
    strongest = objection(effect, fit, observations)
    return None if strongest is None else strongest.reason


def ends(effect: str, fit: Fit) -> Iterator[str]:
    """Values of an effect that a fit left at an end of their range that means something, in words; none where it was
    stopped."""
    values, about = fit.model.effects[effect], EFFECTS[effect]
    searched = [] if fit.outcome is Outcome.STOPPED else [name for name in values if (effect, name) in fit.free]
    for one in (parameter((effect, name)) for name in searched if name not in about.linear):
        if values[one.name] in one.bounds:
            if values[one.name] == one.bounds[0]:
                yield f"{one.name} is at its smallest allowed value ({one.meaning})"
            elif one.name not in about.open_ended:
                yield f"{one.name} is at its largest allowed value ({one.meaning})"


def _doubts(effect: str, fit: Fit, observations: Sequence[Observation]) -> Iterator[str]:
    values, about = fit.model.effects[effect], EFFECTS[effect]
    if not is_excited(effect, observations):
        if "ground" in about.needs:
            yield "it depends on the acceleration of the ground, which no record has"
        elif "axial_load" in about.needs:
            yield "it depends on the vertical motion, which no record has"
        else:
            yield "it depends on motion in the other direction, which no record has"
    yield from ends(effect, fit)
    length = unusual_length(effect, fit.model)
    if length is not None:
        if about.kind == "sliding":
            yield f"{length.name} is rather the length of a damper that yields ({length.meaning})"
        else:
            yield f"{length.name} is rather the length of a slider ({length.meaning})"
    speed = unusual_speed(effect, fit.model)
    if speed is not None:
        yield f"{speed.name} is rather that of friction which hardly changes with the speed ({speed.meaning})"
    for name, simple in about.special.items():
        if (effect, name) not in fit.free:
            continue
        away, std = abs(values[name] - simple), fit.std[effect, name]
        if name in about.open_ended:  # its influence fades: the larger it is, the less of it is known
            away, std = abs(log(values[name] / simple)), std / values[name]
        if away < CERTAIN * std:
            yield f"{name} may be {simple:g}, where a simpler law is sufficient ({parameter((effect, name)).meaning})"
    lost = [name for of, name in fit.undetermined if of == effect and _must_be_known((of, name), fit)]
    if lost:
        yield f"the records do not determine {', '.join(lost)}"


def _of_wrong_masses(effect: str, fit: Fit, observations: Sequence[Observation]) -> str | None:
    """Part of the building that makes the same force if its masses are wrong; None if nothing does.

    The force is estimated from masses and accelerations. Its error is a mass that is wrong times an acceleration: that
    of the slab, as if by a rigid mass, or that of a floor, as if by masses on springs with all modes of the
    superstructure. Identified modes outside the range of the effect's values are brought within it.
    """
    about = EFFECTS[effect]
    if "ground" not in about.needs or {one.name for one in about.parameters} != RIGID.keys():
        return None  # it is no mass on a spring, on which the slab's absolute acceleration acts
    data = FitData.by_noise(observations)
    own = _whitened(effect, fit.model.effects[effect], data)
    others = [key[0] != effect for key in fit.free]
    tangent = np.linalg.qr(tangents(data, fit)[others].T).Q
    rigid = _whitened(effect, RIGID, data)
    known = [one.estimate.superstructure for one in observations if one.estimate is not None]
    for modes in dict.fromkeys(known) or (None,):
        alike = [rigid]
        if modes is not None:
            frequencies = np.clip(modes.frequency, *parameter((effect, "frequency")).bounds)
            ratios = np.clip(modes.damping_ratio, *parameter((effect, "damping")).bounds)
            values = zip(frequencies, ratios, strict=True)
            alike += [_whitened(effect, {"mass": 1.0, "frequency": f, "damping": z}, data) for f, z in values]
        if not _is_made_of(own, np.array(alike), tangent):
            continue
        near = max(range(len(alike)), key=lambda n: (own @ alike[n]) / np.linalg.norm(alike[n]))
        if near == 0 or modes is None:
            return "it moves with the slab: a wrong mass in the building file would make the same force"
        frequency = modes.frequency[near - 1]
        return (
            f"it swings as mode {near} of the superstructure, at {frequency:.3g} Hz: wrong masses of floors in the "
            "building file would make the same force"
        )
    return None


def _whitened(effect: str, values: Mapping[str, float], data: FitData) -> Vector:
    """(m,) force of an effect alone in all earthquakes, whitened."""
    alone = Isolator({effect: values})
    forces = (response_to(excitation_by(one), alone).force for one in data.observations)
    each = zip(data.whitenings, forces, strict=True)
    return np.concatenate([whitening.of(force[None])[0] for whitening, force in each])


def _is_made_of(one: Vector, others: Matrix, tangent: Matrix) -> bool:
    """True if a whitened force differs from a weighted sum of others by no more than the noise hides.

    Args:
        one: (m,).
        others: (k, m).
        tangent: (m, p), orthonormal; what other parameters of the model make.
    """
    unit = others / np.linalg.norm(others, axis=1, keepdims=True)
    rest = one - np.linalg.lstsq(unit.T, one, ALIKE)[0] @ unit
    if rest @ rest > (1 - SAME**2) * (one @ one):
        return False
    own, unit = one - tangent @ (tangent.T @ one), unit - (unit @ tangent) @ tangent.T
    rest = own - np.linalg.lstsq(unit.T, own, ALIKE)[0] @ unit
    return bool(rest @ rest < APART * one.size)


def _must_be_known(key: Key, fit: Fit) -> bool:
    """False for an instant, which need not be known any better between two earthquakes, and for a shape without any
    influence at its value, as the sharpness of a bend that is over within a sample."""
    is_shape = key[1] not in EFFECTS[key[0]].linear
    return not parameter(key).is_instant and not (is_shape and fit.std[key] == 0)


def _work(model: Isolator, observation: Observation) -> float:
    """J, that the layer takes up, and a little more for what is numerical: below 0 it gives."""
    power = response_to(excitation_by(observation), model).force * observation.layer.velocity
    return float(np.sum(power) + FED * np.sum(np.abs(power))) / observation.rate
