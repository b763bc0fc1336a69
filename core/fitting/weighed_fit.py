"""Which values do records ask for, and how well are they known, if a model leaves more than noise?"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.arrays import Vector
from core.errors import RecordError
from core.fitting.fit import Fit, finite_fit
from core.fitting.layer_columns import Evidence
from core.fitting.observation import Observation
from core.model.isolator import Isolator
from core.signals.whitening import reweighted


@dataclass(frozen=True, slots=True, eq=False)
class WeighedFit:
    """A fit whose records weigh by what it leaves over of them."""

    fit: Fit
    evidence: Evidence
    inflation: float
    """At least 1: by how much wider than the fit has them variances are, since what a model lacks is no white noise."""


def weighed_fit(observations: Sequence[Observation], model: Isolator) -> WeighedFit:
    """Fitted by the noise, weighed anew by what that leaves over, and fitted again.

    Args:
        observations: the records.
        model: effects, and values to start from.

    Raises:
        RecordError: there is nothing to fit to.
        ModelError: the model's force grows beyond all bounds.
    """
    if not observations:
        raise RecordError("no earthquake is left to fit to; one that is not held out, with force and motion, would do")
    by_noise = Evidence.by_noise(sorted(observations, key=lambda one: one.start))
    first = finite_fit(by_noise, model)
    evidence = weighed_by(by_noise, first)
    fit = finite_fit(evidence, first.model)
    evidence.memory.clear()
    return WeighedFit(fit, evidence, inflation(evidence, fit))


def left_over(evidence: Evidence, fit: Fit) -> Vector:
    """(records,) N, root mean square of what a fit to the evidence leaves over within the band."""
    spans = zip(evidence.spans, evidence.whitenings, strict=True)
    return np.array([np.linalg.norm(fit.residual[span] * w.std) / np.sqrt(w.count) for span, w in spans])


def error(evidence: Evidence, fit: Fit) -> float:
    """N, the same over all records."""
    count = np.array([w.count for w in evidence.whitenings])
    return float(np.sqrt(np.sum(count * left_over(evidence, fit) ** 2) / np.sum(count)))


def weighed_by(by_noise: Evidence, fit: Fit) -> Evidence:
    """The same records, weighed by what a fit to them leaves over where that is more than noise."""
    residuals = [fit.residual[span] for span in by_noise.spans]
    return by_noise.weighed(reweighted(by_noise.whitenings, residuals))


def inflation(evidence: Evidence, fit: Fit) -> float:
    """The residual's mean power where the force lies, over that everywhere; 1 for noise."""
    each = []
    for span in evidence.spans:
        power, force = fit.residual[span] ** 2, evidence.target[span] ** 2
        each.append(np.sum(power * force) / (np.sum(force) * np.mean(power)))
    return max(1.0, float(np.mean(each)))
