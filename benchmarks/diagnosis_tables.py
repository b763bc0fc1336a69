"""Tables of the diagnosis trials: groups of trials, criteria, and the shares that are right."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import permutations
from math import isfinite

import numpy as np

from benchmarks.diagnosis_trial import WEAK as WEAK_ONLY, Row, family  # isort: skip  (it finds hidden)
from hidden.case import ANOTHER, FAULTS, FAULTS_AND_LAWS, ONE_DIRECTION, OUTSIDE, PAIRS, SAME

from benchmarks.table import Table

WEAK = 0.02
"""Misfit up to which a hidden law need not be seen."""


WRONG_MASSES = "floor_masses"
"""Case of wrong floor masses: nothing is hidden in the layer, and the building file is to be suspected."""
NOTHING = ("nothing", *(f"nothing+{word}" for word in ("pink", "gains", "coarse", "clocks", "moving")), WRONG_MASSES)
"""Cases of a layer in which nothing is hidden."""
BEYOND = ("moat", "moat_hertz", "self_centring", "hardening")
"""Laws that act at large displacements most, or only there."""


@dataclass(frozen=True, slots=True)
class Group:
    """Trials that are judged alike."""

    name: str
    cases: tuple[str, ...]
    seeds: int
    """Number of trials of each case."""


GROUPS = (
    Group("same law", SAME, 6),
    Group("other law of the family", ANOTHER, 4),
    Group("outside the library", OUTSIDE, 6),
    Group("two effects", PAIRS, 2),
    Group("nothing hidden", NOTHING, 16),
    Group("design values off", ("refit",), 10),
    Group("a sensor errs", FAULTS, 2),
    Group("mass 10 % off", ("mass",), 20),
    Group("a storey softened", ("storey",), 20),
    Group("a sensor errs and an effect is hidden", FAULTS_AND_LAWS, 1),
    Group("beyond the fitted range", tuple(name + WEAK_ONLY for name in BEYOND), 4),
    Group("in one direction only", ONE_DIRECTION, 2),
)
"""The usual trials."""


@dataclass(frozen=True, slots=True)
class Criterion:
    """Share of trials that are right."""

    what: str
    cases: tuple[str, ...]
    is_asked: Callable[[Row], bool]
    """Selects the trials that count."""
    is_right: Callable[[Row], bool]


def tables(rows: Sequence[Row]) -> list[Table]:
    """Tables of the page."""
    of = {group.name: [one for one in rows if one.case in group.cases] for group in GROUPS}
    same, other, outside, two, nothing, refit, faults, mass, storey, both, beyond, one_way = of.values()
    strong, others, far = ([one for one in group if _is_strong(one)] for group in (same, other, outside))
    weak = [one for one in same if not _is_strong(one)]
    right, wrong = ([one for one in nothing if _has_wrong_masses(one) == is_so] for is_so in (False, True))
    asked = (
        ("same law, misfit > 2 %: named first", "≥ 98 %", _share(strong, _named_first)),
        ("same law, misfit > 2 %: another named first", "≤ 1 %", _share(strong, _misnamed)),
        ("same law, misfit > 2 %: nothing more named", "", _share(strong, lambda o: len(o.named) <= 1)),
        ("same law, misfit > 2 %: the set contains it", "≥ 98 %", _share(strong, _in_set)),
        ("same law, misfit > 2 %: size of the set", "≤ 1.5", _mean(len(o.sets[0]) for o in strong if o.sets)),
        ("same law, misfit > 2 %: noise ratio, median", "≤ 1.02", _quantile(strong, 0.5)),
        ("same law, misfit > 2 %: noise ratio, 90 %", "≤ 1.10", _quantile(strong, 0.9)),
        ("same law, misfit ≤ 2 %: another named", "", _share(weak, _misnamed)),
        ("other law, misfit > 2 %: family named first", "≥ 95 %", _share(others, _family_first)),
        ("other law, misfit > 2 %: unknown, its family resembled", "", _share(others, _family_resembled)),
        ("other law, misfit > 2 %: unknown, another resembled", "", _share(others, _misled)),
        ("other law, misfit > 2 %: another family named", "", _share(others, _another_family)),
        ("other law, misfit > 2 %: noise ratio, 90 %", "", _quantile(others, 0.9)),
        ("outside, misfit > 2 %: flagged as unknown", "≥ 95 %", _share(far, lambda o: o.unknown)),
        ("outside, misfit > 2 %: outcome unknown", "", _share(far, _is("unknown"))),
        ("nothing hidden: an effect named", "≤ 1 %", _share(nothing, _blamed)),
        ("nothing hidden, masses right: sensor, mass or storey suspected", "≤ 1 %", _share(right, _suspects_any)),
        ("floor masses 20 % off: outcome mass", "", _share(wrong, _is("mass"))),
        ("floor masses 20 % off: outcome unknown", "0", _share(wrong, _is("unknown"))),
        ("design values off: refit", "", _share(refit, _is("refit"))),
        ("two effects: both and no other", "≥ 90 %", _share(two, _both)),
        ("two effects: the sets contain both", "", _share(two, _in_sets)),
        ("two effects: outcome unknown", "", _share(two, _is("unknown"))),
        ("a sensor errs: outcome sensor_fault", "≥ 95 %", _share(faults, _is("sensor_fault"))),
        ("a sensor errs: kind and channel's kind named", "≥ 95 %", _share(faults, _sensor_named)),
        ("a sensor errs: an effect blamed", "0", _share(faults, _blamed)),
        ("a sensor errs and an effect is hidden: both named", "≥ 90 %", _share(both, _fault_and_effect)),
        ("a sensor errs and an effect is hidden: the fault named", "", _share(both, _sensor_named)),
        ("a sensor errs and an effect is hidden: the effect named first", "", _share(both, _named_first)),
        ("beyond the fitted range: this stated, or the family named", "", _share(beyond, _range_or_family)),
        ("beyond the fitted range: another family named", "0", _share(beyond, _another_family)),
        ("in one direction only: stated for the family", "", _share(one_way, _said_of_x)),
        ("in one direction only: something else stated for one direction", "0", _share(one_way, _said_of_another)),
        ("mass 10 % off: outcome mass", "≥ 95 %", _share(mass, _is("mass"))),
        ("mass 10 % off: an effect blamed", "0", _share(mass, _blamed)),
        ("a storey softened: outcome superstructure", "≥ 95 %", _share(storey, _is("superstructure"))),
        ("a storey softened: an effect blamed", "0", _share(storey, _blamed)),
        ("new earthquake, same law: displacement NRMSE, median", "≤ 1 %", _percent(_predicted(strong))),
        ("the same, the model as it was given, fitted", "", _percent([o.predicted_before for o in strong])),
        ("new earthquake, other law: displacement NRMSE, median", "≤ 3 %", _percent(_predicted(others))),
        ("processor time of a diagnosis, median", "1 s", _seconds(rows)),
    )
    seeds = f"odd seeds from {min(one.seed for one in rows)} on" if rows else "odd seeds"
    about = f"{len(rows)} trials with {seeds}. Each has a different building, and different motions and values."
    return [
        Table("Outcomes of the diagnosis", about, ("what", "goal", "reached"), asked),
        _by_noise(rows),
        _wrong(rows),
    ]


def _by_noise(rows: Sequence[Row]) -> Table:
    levels = sorted({one.noise for one in rows})
    shares = tuple(
        (question.what, *(_share([one for one in of if one.noise == level], question.is_right) for level in levels))
        for question, of in _asked(rows)
    )
    about = "Noise of every accelerometer, relative to its root mean square."
    return Table("The same by noise", about, ("right", *(f"{100 * level:.0f} % noise" for level in levels)), shares)


def _wrong(rows: Sequence[Row]) -> Table:
    """Table of the trials that are not right in the table by noise."""
    lines = tuple(
        (
            question.what.split(":")[0],
            f"{one.case}, {one.seed}",
            f"{100 * one.noise:.0f} %",
            f"{100 * one.misfit:.1f} %",
            ", ".join([one.outcome, *one.named, *one.suspects]) + (", unknown" if one.unknown else ""),
        )
        for question, of in _asked(rows)
        for one in of
        if not question.is_right(one)
    )
    about = (
        "Misfit: the hidden part of the force, relative to the force. The outcome is followed by the effects or "
        "sensors that were named, and by `unknown` if the diagnosis stated that something remains which no effect "
        "explains."
    )
    return Table("Every trial that went wrong", about, ("of", "case, seed", "noise", "misfit", "outcome"), lines)


def _asked(rows: Sequence[Row]) -> list[tuple[Criterion, list[Row]]]:
    """Each criterion with its trials."""
    return [(one, [row for row in rows if row.case in one.cases and one.is_asked(row)]) for one in QUESTIONS]


def _named_first(one: Row) -> bool:
    return one.named[:1] == one.hidden[:1]


def _misnamed(one: Row) -> bool:
    return bool(one.named) and not _named_first(one)


def _blamed(one: Row) -> bool:
    """True if the outcome is one effect or several."""
    return one.outcome in {"effect", "family", "one_of_set"}


def _family_first(one: Row) -> bool:
    return bool(one.named) and family(one.named[:1]) == family(one.hidden)


def _another_family(one: Row) -> bool:
    return bool(one.named) and not _family_first(one)


def _family_resembled(one: Row) -> bool:
    return one.outcome == "unknown" and bool(family(one.resembles) & family(one.hidden))


def _misled(one: Row) -> bool:
    return one.outcome == "unknown" and not _family_resembled(one)


def _in_set(one: Row) -> bool:
    return bool(one.sets) and one.hidden[0] in one.sets[0]


def _sensor_named(one: Row) -> bool:
    return any(suspect.split("@")[0] == one.case.split("@")[0] for suspect in one.suspects)


def _fault_and_effect(one: Row) -> bool:
    return _sensor_named(one) and _both(one) and one.outcome != "sensor_fault"


def _is_strong(one: Row) -> bool:
    return one.misfit > WEAK


def _range_or_family(one: Row) -> bool:
    return one.outcome == "out_of_range" or _family_first(one)


def _said_of_x(one: Row) -> bool:
    """True if the diagnosis names the family of the hidden law for x alone."""
    return family(one.hidden) <= family([name for name, _, way in _one_way(one) if way == "x"])


def _said_of_another(one: Row) -> bool:
    return any(way != "x" or family([name]) != family(one.hidden) for name, _, way in _one_way(one))


def _one_way(one: Row) -> list[tuple[str, str, str]]:
    return [said.partition("@") for said in one.one_way]


def _in_sets(one: Row) -> bool:
    """Each hidden effect in the set of another step."""
    return len(one.sets) == len(one.hidden) and any(
        all(effect in of for effect, of in zip(one.hidden, sets, strict=True)) for sets in permutations(one.sets)
    )


def _always(one: Row) -> bool:
    return True


def _both(one: Row) -> bool:
    return set(one.named) == set(one.hidden)


def _nothing_said(one: Row) -> bool:
    return not _blamed(one) and not one.suspects


def _suspects_any(one: Row) -> bool:
    return bool(one.suspects)


def _has_wrong_masses(one: Row) -> bool:
    return one.case == WRONG_MASSES


def _has_right_masses(one: Row) -> bool:
    return not _has_wrong_masses(one)


def _masses_or_nothing(one: Row) -> bool:
    return one.outcome in {"mass", "nothing_missing", "refit"}


def _is(outcome: str) -> Callable[[Row], bool]:
    return lambda one: one.outcome == outcome


def _share(rows: Sequence[Row], is_so: Callable[[Row], bool]) -> str:
    count = sum(map(is_so, rows))
    return f"{100 * count / len(rows):.1f} % ({count} of {len(rows)})" if rows else "none run"


def _quantile(rows: Sequence[Row], share: float) -> str:
    left = [one.after for one in rows if isfinite(one.after)]
    return f"{np.quantile(left, share):.3f}" if left else "none run"


def _mean(values: Iterable[float]) -> str:
    every = list(values)
    return f"{np.mean(every):.2f}" if every else "none run"


def _predicted(rows: Sequence[Row]) -> list[float]:
    return [one.predicted for one in rows if isfinite(one.predicted)]


def _percent(values: Sequence[float]) -> str:
    finite = [one for one in values if isfinite(one)]
    return f"{100 * np.median(finite):.2f} %" if finite else "none run"


def _seconds(rows: Sequence[Row]) -> str:
    return f"{np.median([one.seconds for one in rows]):.1f} s" if rows else "none run"


_CASES = {group.name: group.cases for group in GROUPS}
QUESTIONS = (
    Criterion("same law, misfit > 2 %: named first", _CASES["same law"], _is_strong, _named_first),
    Criterion(
        "other law, misfit > 2 %: family named first", _CASES["other law of the family"], _is_strong, _family_first
    ),
    Criterion(
        "outside, misfit > 2 %: flagged as unknown", _CASES["outside the library"], _is_strong, lambda o: o.unknown
    ),
    Criterion("two effects: both and no other", _CASES["two effects"], _always, _both),
    Criterion(
        "nothing hidden, masses right: neither effect nor suspect",
        _CASES["nothing hidden"],
        _has_right_masses,
        _nothing_said,
    ),
    Criterion("floor masses 20 % off: mass, or no more than noise", (WRONG_MASSES,), _always, _masses_or_nothing),
    Criterion("design values off: refit", _CASES["design values off"], _always, _is("refit")),
    Criterion("a sensor errs: outcome sensor_fault", _CASES["a sensor errs"], _always, _is("sensor_fault")),
    Criterion(
        "a sensor errs and an effect is hidden: both named",
        _CASES["a sensor errs and an effect is hidden"],
        _always,
        _fault_and_effect,
    ),
    Criterion(
        "beyond the fitted range: this stated, or the family named",
        _CASES["beyond the fitted range"],
        _always,
        _range_or_family,
    ),
    Criterion("in one direction only: stated for the family", ONE_DIRECTION, _always, _said_of_x),
    Criterion("mass 10 % off: outcome mass", _CASES["mass 10 % off"], _always, _is("mass")),
    Criterion("a storey softened: outcome superstructure", _CASES["a storey softened"], _always, _is("superstructure")),
)
"""By what the second and the third table go."""
