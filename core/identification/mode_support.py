"""Which of the identified modes the record supports: a stable pole may still be a pattern in the noise."""

import numpy as np
from scipy import linalg, signal

from core.arrays import ComplexVector, Matrix, Vector
from core.identification.modal_uncertainty import ModalDeviation

DETERMINED = 4.0
"""Standard deviations between the damping ratio and zero. Poles found in white noise reach about three."""
NOTICEABLE = 0.1
"""Growth of the mean square misfit that no noise explains, even where it does not determine the damping ratio well."""
ROUNDING = 1e-24
"""Of an output's sum of squares."""


def is_supported(damping_ratio: float, deviation: ModalDeviation | None, growth: float) -> bool:
    """Whether a mode is one of the structure: its damping is told from zero, or the record is not explained without it.

    Args:
        damping_ratio: of the mode.
        deviation: its standard deviations, if there are any.
        growth: of the misfit without the mode, relative; the largest of all outputs.
    """
    is_determined = deviation is not None and damping_ratio >= DETERMINED * deviation.damping_ratio
    return is_determined or growth >= NOTICEABLE


def misfit_growth(eigenvalues: ComplexVector, inputs: Matrix, outputs: Matrix) -> Matrix:
    """How much worse the other modes together explain each output than all of them do.

    Every output is fitted by the modes' responses to the inputs and to an impulse at the start, and by the inputs.

    Args:
        eigenvalues: (modes,) of decaying modes, one of each conjugate pair.
        inputs: (m, n).
        outputs: (p, n).

    Returns:
        (modes, outputs) mean square misfit without the mode, relative to that with all, less one.
    """
    impulse = np.eye(1, inputs.shape[1])
    driven = [signal.lfilter([0, 1], [1, -w], np.vstack([inputs, impulse]), axis=1) for w in eigenvalues]
    responses = np.concatenate([part for mode in driven for part in (mode.real, mode.imag)])
    regressors = np.vstack([responses, inputs])
    # One triangle of all there is takes time out of the fits that follow.
    triangle = linalg.qr(np.vstack([regressors, outputs]).T, mode="r", check_finite=False)[0]
    R, Y = np.split(triangle[: triangle.shape[1]], [len(regressors)], axis=1)
    width = len(responses) // len(eigenvalues)
    every = _misfit(R, Y)
    without = [_misfit(np.delete(R, np.s_[i * width : (i + 1) * width], axis=1), Y) for i in range(len(eigenvalues))]
    # An output that the inputs explain to the last digit leaves rounding, which must not be taken for a misfit.
    rounding = ROUNDING * np.sum(outputs**2, axis=1)
    return np.asarray((np.array(without) - every) / (every + rounding))


def _misfit(regressors: Matrix, outputs: Matrix) -> Vector:
    residual = outputs - regressors @ linalg.lstsq(regressors, outputs, check_finite=False)[0]
    return np.asarray(np.sum(residual**2, axis=0))
