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
        """(outputs, n) to inputs of (inputs, n)."""
        state, states = self.start, np.empty((inputs.shape[1], len(self.A)))
        for t, forcing in enumerate((self.B @ inputs).T):
            states[t] = state
            state = self.A @ state + forcing
        return np.asarray(self.C @ states.T + self.D @ inputs)


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
    design = _design(eigenvalues, shapes, inputs)
    solution = linalg.lstsq(design, outputs.ravel(), lapack_driver="gelsy", check_finite=False)[0]
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


def _design(eigenvalues: ComplexVector, shapes: ComplexMatrix, inputs: Matrix) -> Matrix:
    """Outputs to unit entries of B, x(0) and D: 2 Re(c s) to a real one, -2 Im(c s) to an imaginary one."""
    n, p = inputs.shape[1], len(shapes)
    driven = [[signal.lfilter([0, 1], [1, -w], u) for w in eigenvalues] for u in inputs]
    free = eigenvalues[:, None] ** np.arange(n)
    responses = np.array([*driven, free]).reshape(-1, n)
    seen = np.tile(shapes, len(inputs) + 1)[:, None, :] * responses.T
    direct = np.kron(np.eye(p), inputs.T)
    return np.hstack([2 * seen.real.reshape(p * n, -1), -2 * seen.imag.reshape(p * n, -1), direct])
