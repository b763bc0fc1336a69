"""Least squares and means with standard deviations that hold for autocorrelated residuals (HAC)."""

import numpy as np
from scipy.ndimage import uniform_filter1d

from core.arrays import Matrix, Vector

SMOOTH_SHARE = 1 / 32
"""Share of the samples over which a residual is averaged to separate what the model misses from noise. A choice: it
keeps the third and fifth harmonics of one cycle of a hysteretic layer."""
LARGEST_AUTOCORRELATION = 0.97
"""Limit of the first-order autocorrelation in prewhitening, as Andrews and Monahan (1992) recommend."""


def regression(regressors: Matrix, response: Vector) -> tuple[Vector, Matrix]:
    """Least squares, with a covariance that allows for model error and noise.

    The residual of a hysteretic layer is smooth: it is what a spring and a dashpot cannot follow. White noise on top of
    it would hide its autocorrelation. A running mean therefore separates the two, and their covariances are added.

    Args:
        regressors: (n, p).
        response: (n,).

    Returns:
        (p,) coefficients and (p, p) covariance.
    """
    count, coefficients = regressors.shape
    solution = np.asarray(np.linalg.lstsq(regressors, response, rcond=None)[0])
    residual = response - regressors @ solution
    smooth = uniform_filter1d(residual, max(1, round(SMOOTH_SHARE * count)), mode="nearest")
    meat = _prewhitened(regressors * smooth[:, None]) + _prewhitened(regressors * (residual - smooth)[:, None])
    bread = np.linalg.pinv(regressors.T @ regressors)
    covariance: Matrix = bread @ meat @ bread * count / (count - coefficients)
    return solution, covariance


def mean_with_std(samples: Vector) -> tuple[float, float]:
    """Mean of an autocorrelated history, and its standard deviation."""
    solution, covariance = regression(np.ones((samples.size, 1)), samples)
    return float(solution[0]), float(np.sqrt(covariance[0, 0]))


def covariance_of_sum(terms: Matrix, lags: int) -> Matrix:
    """(p, p) covariance of the sum of (n, p) terms that are correlated over so many samples.

    Newey and West (1987): the Bartlett kernel keeps it positive semidefinite.
    """
    covariance: Matrix = terms.T @ terms
    for lag in range(1, lags + 1):
        product = terms[lag:].T @ terms[:-lag]
        covariance += (1 - lag / (lags + 1)) * (product + product.T)
    return covariance


def _prewhitened(score: Matrix) -> Matrix:
    """(p, p) covariance of the sum of an autocorrelated (n, p) score.

    Each coefficient is prewhitened by a first-order process (Andrews and Monahan, 1992); the number of lags is that of
    Newey and West (1994) for the Bartlett kernel.
    """
    power = np.maximum(np.sum(score**2, axis=0), np.finfo(float).tiny)
    ρ = np.clip(np.sum(score[1:] * score[:-1], axis=0) / power, 0, LARGEST_AUTOCORRELATION)
    white = score[1:] - ρ * score[:-1]
    lags = int(4 * (white.shape[0] / 100) ** (2 / 9))
    return np.asarray(covariance_of_sum(white, lags) / np.outer(1 - ρ, 1 - ρ))
