"""Share of the floors in the building's mass, estimated from the records of several earthquakes.

The restoring force is F = −M (a + s r): M is the total mass, a the base slab's acceleration, s the floors' share of the
mass, and r the mean acceleration of the floors relative to the slab, weighted by their masses. M scales all forces, as
a stiffer layer does, so that records do not determine it. They do determine s: with a wrong share the estimated force
holds one that swings as the superstructure does, which no law of the layer makes but that of a mass on a spring with
the frequency and damping of a mode.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from core.arrays import Vector
from core.description import BuildingDescription
from core.diagnosis.worth import Judge, NoiseRatios, Worth, worth
from core.errors import ModelError
from core.fitting.data import FitData
from core.fitting.fit import WeightedFit, reweighted_fit, tangents
from core.fitting.observation import Observation
from core.model.isolator import Isolator

CERTAIN = 4.0
"""Standard deviations by which the share must differ from that of the building file. A choice."""
UNEVEN = 0.1
"""Standard deviation of the change over the change: floors whose masses are wrong are so by different shares, and the
estimated force then has the modes in other proportions too. A choice: on the seeds 7, 13, 23 and 27 of
benchmarks.diagnosis with wrong floor masses, and 0 beside a hidden effect, the change was off by up to 14 %."""
ROUNDS = 3
"""Fits of the model, each to forces with the share of the one before. A choice: the second changes the share by less
than its standard deviation."""
OPEN = 1e-6
"""Share of the force of the floors' motion that is its own, below which the model's parameters imitate it. A choice."""


@dataclass(frozen=True, slots=True)
class FloorShare:
    """Share of the floors in the building's mass, where it differs from the building file's."""

    stated: float
    """By the building file."""
    change: float
    """Relative change of the share: the records' over the stated one, less 1."""
    std: float
    """Standard deviation of the change, by noise, by the scatter between earthquakes and by UNEVEN."""
    before: NoiseRatios
    """Noise ratios of the fitted model, with the forces as estimated."""
    after: NoiseRatios
    """The same, with the forces for the share of the records."""

    @property
    def share(self) -> float:
        """By the records."""
        return self.stated * (1 + self.change)

    @property
    def worth(self) -> Worth:
        """Share of the excess error that the change takes."""
        return worth(self.before, self.after)

    @property
    def ratio(self) -> tuple[float, float]:
        """Ratio of the floors' mass to the slab's in the building file over that by the records, and its standard
        deviation."""
        stated, true = self.stated / (1 - self.stated), self.share / (1 - self.share)
        return stated / true, stated / true * self.std / ((1 + self.change) * (1 - self.share))


def wrong_floor_share(
    fitted: Sequence[Observation],
    held_out: Sequence[Observation],
    model: Isolator,
    description: BuildingDescription,
) -> FloorShare | None:
    """The floors' share of the mass; None unless it certainly differs from the building file's and takes as much of the
    model's excess error as an effect must for a name (`core.diagnosis.worth`).

    Args:
        fitted: observations that the model is fitted to.
        held_out: observations of other earthquakes.
        model: of the layer.
        description: of the building.
    """
    seen = sorted(fitted, key=lambda one: one.start)
    if any(one.estimate is None for one in (*seen, *held_out)):
        return None
    modal = [one.estimate.modal for one in seen if one.estimate is not None]
    floors = float(description.floor_mass.sum())
    stated = floors / (floors + description.base_mass)
    try:
        first = now = reweighted_fit(FitData.by_noise(seen), model)
        change, std = 0.0, 0.0
        for _ in range(ROUNDS):
            more, std = _change(now, modal)
            change += more
            now = reweighted_fit(FitData.by_noise([with_floor_share(one, change) for one in seen]), now.fit.model)
    except ModelError:  # the model diverges at values beside these forces
        return None
    std = float(np.hypot(std, UNEVEN * change))
    if not abs(change) > CERTAIN * std or not 0 < stated * (1 + change) < 1:
        return None
    tested = [with_floor_share(one, change) for one in held_out]
    found = FloorShare(
        stated,
        change,
        std,
        Judge.of(seen, held_out).noise_ratios(first.fit.model),
        Judge.of(now.data.observations, tested).noise_ratios(now.fit.model),
    )
    return found if found.worth.earns_a_name else None


def with_floor_share(observation: Observation, change: float) -> Observation:
    """The observation with the force for another share of the floors in the same total mass.

    Args:
        observation: with its estimate.
        change: relative change of the share.
    """
    known, layer = observation.estimate, observation.layer
    if known is None:
        return observation
    more = change * known.modal
    return replace(
        observation,
        layer=replace(layer, force=layer.force + more),
        estimate=replace(known, force=known.force + more, modal=known.modal + more),
    )


def _change(now: WeightedFit, modal: Sequence[Vector]) -> tuple[float, float]:
    """Further change of the share that lowers a fit's error most, and its standard deviation; (0, inf) if the model's
    parameters imitate it.

    Each earthquake has an estimate of its own. Where they differ by more than their noise, the standard deviation is
    larger by the ratio of Birge (1932).

    Args:
        now: the fit.
        modal: N, of each earthquake, force of the floors' motion relative to the slab, at the stated share.
    """
    data = now.data
    basis = np.linalg.qr(tangents(data, now.fit).T).Q
    rows = np.zeros((len(modal), data.target.size))
    for row, force, whitening, span in zip(rows, modal, data.whitenings, data.spans, strict=True):
        row[span] = whitening.of(force[None])[0]
    own = rows - (rows @ basis) @ basis.T
    information = own @ own.T / now.inflation
    if np.sum(information) * now.inflation < OPEN * np.sum(rows**2):
        return 0.0, np.inf
    pull = -(own @ now.fit.residual) / now.inflation
    weights = information.sum(axis=0)
    change = float(pull.sum() / weights.sum())
    left = pull - weights * change
    scatter = float(left @ np.linalg.pinv(information, hermitian=True) @ left) / max(len(rows) - 1, 1)
    return change, float(np.sqrt(max(1.0, scatter) / weights.sum()))
