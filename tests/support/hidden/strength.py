"""Strengths of ground motions and hidden laws that give the planned peaks and misfits."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hidden.building import Building
from hidden.ground import DURATION
from hidden.integration import Hidden, Response, simulate_building, states_between_events
from hidden.law import Law, Need
from hidden.laws.layer import YIELDING
from hidden.misfit import misfit
from hidden.plan import FITTED, Plan, shaking

COARSE = 125.0
"""Hz, steps of the integrations in this search."""
CLOSE = 0.07
"""Share by which peaks may be off."""
STRONGEST = 8.0
"""Times what a law is drawn with."""


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """Responses in successive earthquakes; the layer keeps some of its states."""

    scales: tuple[float, ...]
    """m/s², peak ground accelerations along x."""
    answers: tuple[Response, ...]


def with_usual_yielding(building: Building, hidden: Sequence[Hidden]) -> tuple[Hidden, ...]:
    """The hidden laws, and the layer's usual yielding unless one of them takes its place."""
    if any(law.kind == "yielding" for law, _ in hidden):
        return tuple(hidden)
    values = YIELDING.values(building.layer, np.random.default_rng(0))  # it draws nothing
    return ((YIELDING, values), *hidden)


def simulate_events(
    building: Building,
    laws: Sequence[Hidden],
    plans: Sequence[Plan],
    scales: Sequence[float],
    rate: float,
    happens: frozenset[Need],
) -> Course:
    """Responses at given scales, integrated at the given rate in Hz."""
    answers: list[Response] = []
    for number, (plan, scale) in enumerate(zip(plans, scales, strict=True)):
        states = _kept(laws, answers, plans, number)
        answers.append(simulate_building(building, laws, shaking(plan, scale, rate, happens), states))
    return Course(tuple(scales), tuple(answers))


def scaled_to_peaks(
    building: Building, laws: Sequence[Hidden], plans: Sequence[Plan], begin: Sequence[float], happens: frozenset[Need]
) -> Course:
    """The course in which the peaks are about those planned, from scales to begin the search with."""
    scales: list[float] = []
    answers: list[Response] = []
    for number, (plan, scale) in enumerate(zip(plans, begin, strict=True)):
        states = _kept(laws, answers, plans, number)
        for _ in range(10):
            answer = simulate_building(building, laws, shaking(plan, scale, COARSE, happens), states)
            reached = float(np.abs(answer.displacement[0]).max())
            if abs(reached / plan.peak - 1) < CLOSE:
                break
            scale *= float(np.clip(plan.peak / reached, 0.1, 10)) ** 0.85  # yielding makes the peak rise faster
        scales.append(scale)
        answers.append(answer)
    return Course(tuple(scales), tuple(answers))


def scaled_to_misfit(
    building: Building,
    hidden: Hidden,
    plans: Sequence[Plan],
    begin: Sequence[float],
    happens: frozenset[Need],
    wanted: float,
) -> Hidden:
    """The law made stronger or weaker until its misfit is about the wanted one, or its limits are met."""
    law, drawn = hidden
    values, scales = drawn, begin
    for _ in range(5):
        laws = with_usual_yielding(building, ((law, values),))
        found = scaled_to_peaks(building, laws, plans[:FITTED], scales[:FITTED], happens)
        scales, reached = found.scales, misfit_of(found)
        factor = float(np.clip(wanted / max(reached, 1e-6), 0.2, 4))
        stronger = _stronger(law, drawn, values, factor)
        if 0.8 < factor < 1.25 or stronger == values:
            break
        values = stronger
    return law, values


def misfit_of(found: Course, every: int = 1) -> float:
    """Misfit (hidden.misfit) of the earthquakes to fit, along x, with a thinned series of steps."""
    answers = found.answers[:FITTED]
    displacement, velocity, force = (
        [getattr(answer, name)[0, ::every] for answer in answers] for name in ("displacement", "velocity", "force")
    )
    return misfit(displacement, velocity, force)


def _stronger(law: Law, drawn: Mapping[str, float], values: Mapping[str, float], factor: float) -> Mapping[str, float]:
    limits = law.limits or {}
    return {
        name: min(value * factor, limits.get(name, np.inf), drawn[name] * STRONGEST) if name in law.strength else value
        for name, value in values.items()
    }


def _kept(laws: Sequence[Hidden], answers: Sequence[Response], plans: Sequence[Plan], number: int):  # noqa: ANN202
    """States at the beginning of an earthquake, or None before the first."""
    if not number:
        return None
    rest = (plans[number].start - plans[number - 1].start).total_seconds() - DURATION
    return states_between_events(laws, answers[number - 1].states, rest)
