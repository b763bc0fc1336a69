from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import linalg, signal

from core.errors import IdentificationError
from core.identification.realisation import StateSpace, realise


def system(rng: np.random.Generator, modes: int, inputs: int, outputs: int) -> StateSpace:
    """Decaying modes apart from each other, in coordinates that are nobody's modal ones."""
    w = rng.uniform(0.9, 0.98, modes) * np.exp(1j * (np.linspace(0.2, 2.4, modes) + rng.uniform(-0.1, 0.1, modes)))
    T = linalg.qr(rng.standard_normal((2 * modes,) * 2))[0]
    return StateSpace(
        A=T @ linalg.block_diag(*([[x.real, -x.imag], [x.imag, x.real]] for x in w)) @ T.T,
        B=rng.standard_normal((2 * modes, inputs)),
        C=rng.standard_normal((outputs, 2 * modes)),
        D=rng.standard_normal((outputs, inputs)),
        start=rng.standard_normal(2 * modes),
    )


def stepped(model: StateSpace, inputs: np.ndarray) -> np.ndarray:
    """Eq 12, sample by sample."""
    x, outputs = model.start, []
    for u in inputs.T:
        outputs.append(model.C @ x + model.D @ u)
        x = model.A @ x + model.B @ u
    return np.array(outputs).T


def cosine(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.sum(one * other) / (linalg.norm(one) * linalg.norm(other)))


sizes = {"modes": st.integers(1, 4), "inputs": st.integers(1, 2), "outputs": st.integers(1, 3)}


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), **sizes)
def test_response_is_the_recursion(seed: int, modes: int, inputs: int, outputs: int) -> None:
    rng = np.random.default_rng(seed)
    model, u = system(rng, modes, inputs, outputs), rng.standard_normal((inputs, 200))
    exact = stepped(model, u)
    assert model.response(u) == pytest.approx(exact, abs=1e-9 * np.abs(exact).max())


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), **sizes)
def test_recovers_input_feedthrough_and_start(seed: int, modes: int, inputs: int, outputs: int) -> None:
    """Exact data: the same transfer function (by its first Markov parameters) and the same response."""
    rng = np.random.default_rng(seed)
    truth, u = system(rng, modes, inputs, outputs), rng.standard_normal((inputs, 400))
    y = stepped(truth, u)
    found = realise(truth.A, truth.C, u, y)
    size = np.abs(y).max()
    assert found.response(u) == pytest.approx(y, abs=1e-7 * size)
    assert pytest.approx(truth.D, abs=1e-7 * size) == found.D
    for power in range(4):
        markov = truth.C @ np.linalg.matrix_power(truth.A, power) @ truth.B
        assert found.C @ np.linalg.matrix_power(found.A, power) @ found.B == pytest.approx(markov, abs=1e-6 * size)


def test_is_the_least_squares_fit() -> None:
    """No other B, D and start come nearer: the misfit is orthogonal to what each entry of B can do."""
    rng = np.random.default_rng(4)
    truth, u = system(rng, 2, 1, 2), rng.standard_normal((1, 500))
    y = stepped(truth, u) + rng.standard_normal((2, 500))
    misfit = y - realise(truth.A, truth.C, u, y).response(u)
    still = StateSpace(truth.A, np.zeros((4, 1)), truth.C, np.zeros((2, 1)), np.zeros(4))
    entries = np.eye(4)
    changed = [replace(still, B=entry[:, None]) for entry in entries] + [replace(still, start=e) for e in entries]
    for direction in (stepped(change, u) for change in changed):
        assert cosine(misfit, direction) == pytest.approx(0, abs=1e-8)
    assert [cosine(row, u[0]) for row in misfit] == pytest.approx([0, 0], abs=1e-8)


def test_modes_that_grow_are_left_out() -> None:
    rng = np.random.default_rng(5)
    u, w = rng.standard_normal((1, 300)), 0.95 * np.exp(0.5j)
    y = signal.lfilter([0, 1], [1, -w], u).real
    grown = linalg.block_diag([[w.real, -w.imag], [w.imag, w.real]], [[1.0, -0.3], [0.3, 1.0]])
    found = realise(grown, np.ones((1, 4)), u, y)
    assert found.A.shape == (2, 2)
    assert found.response(u) == pytest.approx(y, abs=1e-9)
    with pytest.raises(IdentificationError, match="every mode of the system grows"):
        realise(grown[2:, 2:], np.ones((1, 2)), u, y)
