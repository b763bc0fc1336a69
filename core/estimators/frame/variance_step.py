"""Which variances of unmodelled motion explain a record better than those at hand?"""

import numpy as np

from core.arrays import Matrix
from core.estimators.frame.evaluation import Evaluation
from core.estimators.frame.unmodelled_motion import DYNAMIC_SHARE, Variances, local_covariance


def improved(here: Evaluation) -> Variances:
    """The next variances by restricted maximum likelihood: the factors of Zhou, Hu, Qiao, Cho and Zhou (2019).

    Args:
        here: the evaluation by a hypothesis that allows for unmodelled motion.
    """
    met, size = _strengths(here)
    lines, count = here.question.lines, here.variances.rocking.size
    met, size = (np.array([np.bincount(lines.band, row, count) for row in each]) for each in (met, size))
    rocking, floors = np.sqrt(met / np.maximum(size, 1e-300))
    return Variances(here.variances.rocking * rocking, here.variances.floors * floors)


def _strengths(here: Evaluation) -> tuple[Matrix, Matrix]:
    """(2, lines) |Bᴴ P z|² and trace Bᴴ P B: of the rocking, and of the floors' own motion."""
    lines = here.question.lines
    noise = lines.noise[1:]
    local = local_covariance(here.question.design)[1:, 1:] / np.sqrt(np.outer(noise, noise))
    factor = np.linalg.cholesky(local)
    alone = np.zeros((len(factor), len(factor) + 1, here.residual.shape[1]), dtype=complex)
    alone[:, 1:] = factor.T[:, :, None] / np.sqrt(lines.colour)
    alone = here.whitened.of(alone)
    share, through = DYNAMIC_SHARE, here.unmodelled
    met = np.abs(np.einsum("icl,cl->il", through.conj(), here.residual)) ** 2
    met_alone = np.abs(np.einsum("icl,cl->il", alone.conj(), here.residual)) ** 2
    size, size_alone = (np.sum(np.abs(each) ** 2, axis=1) for each in (through, alone))
    return (
        np.array([met[0], share * met[1:].sum(axis=0) + (1 - share) * met_alone.sum(axis=0)]),
        np.array([size[0], share * size[1:].sum(axis=0) + (1 - share) * size_alone.sum(axis=0)]),
    )
