"""Onset of a change: the interval of events that holds it, from its posterior.

Every onset of a change has the likelihood ratio of its pattern, the size integrated out under a normal prior; all
onsets are equally likely beforehand (Smith, 1975; Barry and Hartigan, 1993). Rules of one sign share the posterior,
because a small sudden loss and the beginning of a slow one are hard to distinguish.
"""

from collections.abc import Sequence

import numpy as np

from core.arrays import Vector
from core.drift.change_statistics import CLIP, Innovations, ReferenceDeviations, signed_roots, whitened
from core.drift.rules import Rule

ONSET_LEVEL = 0.95
"""Posterior probability of an onset interval; docs/operate/drift.md says how often the interval contains the truth."""
ONSET_SIZE = 0.2
"""Prior standard deviation of the size of a change; relative. A choice; docs/operate/drift.md has the coverage of the
intervals that it leads to."""


def onset_interval(white: Innovations, rules: Sequence[Rule], scale: float, first: int, last: int) -> tuple[int, int]:
    """The shortest run of onsets with a posterior probability of `ONSET_LEVEL`.

    Args:
        white: innovations of the events whose evidence counts.
        rules: kinds of change that are possible.
        scale: unit of the sizes of changes, 1 for a logarithm.
        first: earliest onset that is possible.
        last: latest onset that is possible.

    Returns:
        The earliest and the latest onset of the run, both included.
    """
    logarithm = np.array([_log_posterior(white, rule, scale)[first : last + 1] for rule in rules])
    weight = np.exp(logarithm - logarithm.max()).sum(axis=0)
    share = np.concatenate([[0.0], np.cumsum(weight / weight.sum())])
    ends = np.searchsorted(share, share[:-1] + ONSET_LEVEL - 1e-12)
    possible = np.flatnonzero(ends < share.size)
    start = int(possible[(ends[possible] - possible).argmin()])
    return first + start, first + int(ends[start]) - 1


def changed_reference_events(reference: ReferenceDeviations, size: float) -> int:
    """Number of events at the end of the reference that may already show a sudden change of this size.

    The reference is not tested, and a change that began in its last events shows from the first tested event on. Each
    of these events counts for or against the change by its likelihood, clipped; with a probability of `ONSET_LEVEL`
    no more events show it.
    """
    deviation = np.clip(reference.deviation[::-1] / reference.std[::-1], -CLIP, CLIP)
    shift = size / reference.std[::-1]
    odds = np.concatenate([[0.0], np.cumsum((deviation**2 - (deviation - shift) ** 2) / 2)])
    share = np.exp(odds - odds.max())
    return int(np.searchsorted(np.cumsum(share / share.sum()), ONSET_LEVEL))


def _log_posterior(white: Innovations, rule: Rule, scale: float) -> Vector:
    """(onsets,) log posterior up to a constant common to all rules, with the size integrated out."""
    patterns = rule.pattern(white.raw.size)
    root, _ = signed_roots(white, patterns, rule.sign)
    length = (whitened(white, patterns) ** 2).sum(axis=0) * (ONSET_SIZE * scale) ** 2
    return np.asarray(root[-1] ** 2 / 2 - np.log1p(length) / 2)
