"""Input, feedthrough and start of a system whose A and C are known, by least squares on its simulated output."""

from dataclasses import dataclass

import numpy as np
from scipy import linalg, signal

from core.arrays import ComplexMatrix, ComplexVector, Matrix, Vector
from core.errors import IdentificationError


@dataclass(frozen=True, slots=True, eq=False)
class StateSpace:
    """x(t+1) = A x(t) + B u(t), y(t) = C x(t) + D u(t) from x(0) (eq 12 without its noise)."""

    A: Matrix
    """(order, order)"""
    B: Matrix
    """(order, inputs)"""
    C: Matrix
    """(outputs, order)"""
    D: Matrix
    """(outputs, inputs)"""
    start: Vector
    """(order,) x(0)."""

    def response(self, inputs: Matrix) -> Matrix:
        """(outputs, n) to inputs of (inputs, n); mode by mode, so that A must be diagonalisable."""
        eigenvalues, vectors = linalg.eig(self.A, check_finite=False)
        forcing = np.hstack([self.start[:, None], self.B @ inputs[:, :-1]])
        modal = np.linalg.inv(vectors) @ forcing
        for mode, w in zip(modal, eigenvalues, strict=True):
            mode[:] = signal.lfilter([1], [1, -w], mode)
        return np.asarray(((self.C @ vectors) @ modal).real + self.D @ inputs)


def realise(A: Matrix, C: Matrix, inputs: Matrix, outputs: Matrix) -> StateSpace:
    """The system with B, D and x(0) that bring its simulated output nearest to the measured one (paper, section 4).

    The result is in real modal form, in which each mode's response is one filter. Modes that grow are left out: a
    superstructure has none, and their simulated output would drown the others.

    Args:
        A: (order, order), diagonalisable.
        C: (outputs, order).
        inputs: (m, n).
        outputs: (p, n).

    Raises:
        IdentificationError: every mode grows.
    """
    eigenvalues, vectors = linalg.eig(A, check_finite=False)
    kept = (np.abs(eigenvalues) < 1) & (eigenvalues.imag >= 0)
    if not kept.any():
        raise IdentificationError("every mode of the system grows; another order would do")
    eigenvalues, shapes = eigenvalues[kept], C @ vectors[:, kept]
    solution = _solution(_responses(eigenvalues, inputs), shapes, inputs, outputs)
    m, p, modes = len(inputs), len(outputs), len(eigenvalues)
    modal = solution[: -m * p].reshape(2, m + 1, modes)
    states = np.stack([modal[0], modal[1]], axis=-1).reshape(m + 1, 2 * modes)
    output_matrix = np.stack([2 * shapes.real, -2 * shapes.imag], axis=-1).reshape(p, 2 * modes)
    return StateSpace(
        A=linalg.block_diag(*([[w.real, -w.imag], [w.imag, w.real]] for w in eigenvalues)),
        B=states[:m].T,
        C=output_matrix,
        D=solution[-m * p :].reshape(p, m),
        start=states[m],
    )


def _responses(eigenvalues: ComplexVector, inputs: Matrix) -> ComplexMatrix:
    """(n, (m + 1) modes) of each mode to each input, and to a unit start."""
    driven = [[signal.lfilter([0, 1], [1, -w], u) for w in eigenvalues] for u in inputs]
    impulse = np.eye(1, inputs.shape[1])[0]
    free = [signal.lfilter([1], [1, -w], impulse) for w in eigenvalues]
    return np.array([*driven, free]).reshape(-1, inputs.shape[1]).T


def _solution(responses: ComplexMatrix, shapes: ComplexMatrix, inputs: Matrix, outputs: Matrix) -> Vector:
    """Entries of B and x(0), real and then imaginary, and of D.

    An output responds by 2 Re(c s) to a real entry and by -2 Im(c s) to an imaginary one. All outputs share the
    responses s, so that one orthogonal triangle of these takes time out of the problem before it is solved.
    """
    k, p = responses.shape[1], len(shapes)
    regressors = np.hstack([responses.real, responses.imag, inputs.T])
    R = linalg.qr(np.hstack([regressors, outputs.T]), mode="r", overwrite_a=True, check_finite=False)[0]
    R, rotated = np.split(R[: regressors.shape[1]], [regressors.shape[1]], axis=1)
    seen = np.tile(shapes, k // shapes.shape[1])[:, None, :]
    real = 2 * (seen.real * R[:, :k] - seen.imag * R[:, k : 2 * k])
    imaginary = -2 * (seen.imag * R[:, :k] + seen.real * R[:, k : 2 * k])
    direct = np.kron(np.eye(p), R[:, 2 * k :])
    design = np.hstack([real.reshape(-1, k), imaginary.reshape(-1, k), direct])
    return np.asarray(linalg.lstsq(design, rotated.T.ravel(), lapack_driver="gelsy", check_finite=False)[0])
