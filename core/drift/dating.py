"""The events between which a change began, by the posterior of its onset.

Every onset has the likelihood ratio of its pattern, its size integrated out under a normal prior, and all onsets are
equally likely beforehand (Smith, 1975; Barry and Hartigan, 1993). Kinds of change that begin alike share the posterior:
a small sudden loss and the beginning of a slow one are hard to distinguish.
"""

from collections.abc import Sequence

import numpy as np

from core.arrays import Vector
from core.drift.judged import Before
from core.drift.rules import Rule
from core.drift.sequential import CLIP, Innovations, evidence, whitened

LEVEL = 0.95
"""Of the posterior that the interval covers; docs/drift.md says how often the truth lies in it."""
SIZE = 0.2
"""Standard deviation of the size of a change beforehand; relative."""


def onset_interval(white: Innovations, rules: Sequence[Rule], scale: float, first: int, last: int) -> tuple[int, int]:
    """The shortest run of onsets that holds `LEVEL` of the posterior.

    Args:
        white: of the events until the one up to which evidence counts.
        rules: kinds of change that there may be.
        scale: unit of the deviations' sizes, 1 of a logarithm.
        first: earliest onset that is possible.
        last: latest onset that is possible.

    Returns:
        The earliest and the latest onset of the run, both included.
    """
    logarithm = np.array([_log_posterior(white, rule, scale)[first : last + 1] for rule in rules])
    weight = np.exp(logarithm - logarithm.max()).sum(axis=0)
    share = np.concatenate([[0.0], np.cumsum(weight / weight.sum())])
    ends = np.searchsorted(share, share[:-1] + LEVEL - 1e-12)
    possible = np.flatnonzero(ends < share.size)
    start = int(possible[(ends[possible] - possible).argmin()])
    return first + start, first + int(ends[start]) - 1


def within_reference(before: Before, size: float) -> int:
    """Events at the end of the reference that may show a sudden change of this size already.

    The reference is not judged, and a change that began in its last events is seen from the first judged event on. Each
    of these events speaks for the change or against it by its likelihood, clipped; at 95 % no more show it.
    """
    deviation = np.clip(before.deviation[::-1] / before.std[::-1], -CLIP, CLIP)
    shift = size / before.std[::-1]
    odds = np.concatenate([[0.0], np.cumsum((deviation**2 - (deviation - shift) ** 2) / 2)])
    share = np.exp(odds - odds.max())
    return int(np.searchsorted(np.cumsum(share / share.sum()), LEVEL))


def _log_posterior(white: Innovations, rule: Rule, scale: float) -> Vector:
    """(onsets,) up to a constant common to all rules; the size integrated out."""
    patterns = rule.pattern(white.raw.size)
    root, _ = evidence(white, patterns, rule.sense)
    length = (whitened(white, patterns) ** 2).sum(axis=0) * (SIZE * scale) ** 2
    return np.asarray(root[-1] ** 2 / 2 - np.log1p(length) / 2)
