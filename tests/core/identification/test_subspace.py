from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy import linalg, signal

from core.arrays import Matrix
from core.errors import IdentificationError
from core.identification.modes import poles
from core.identification.projection import project
from core.identification.subspace import WEIGHTINGS, StateSpace, extended_observability, is_identifiable, realise

every_weighting = pytest.mark.parametrize("name", sorted(WEIGHTINGS))
System = tuple[Matrix, Matrix, Matrix, Matrix]


def real_modal_form(rng: np.random.Generator, modes: int, outputs: int) -> System:
    """Lightly damped modes, apart from each other, in real modal form."""
    angle = np.linspace(0.2, 2.4, modes) + rng.uniform(-0.1, 0.1, modes)
    radius = rng.uniform(0.9, 0.98, modes)
    w = radius * np.exp(1j * angle)
    A = linalg.block_diag(*([[x.real, -x.imag], [x.imag, x.real]] for x in w))
    B, C = rng.uniform(0.5, 1.5, (2 * modes, 1)), rng.uniform(0.5, 1.5, (outputs, 2 * modes))
    return A, B, C * rng.choice([-1, 1], C.shape), rng.standard_normal((outputs, 1))


def simulated(parts: System, u: Matrix, start: np.ndarray) -> Matrix:
    A, B, C, D = parts
    x, states = start, []
    for value in u.T:
        states.append(x)
        x = A @ x + B @ value
    return C @ np.array(states).T + D @ u


@every_weighting
@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), modes=st.integers(1, 4), outputs=st.integers(1, 3))
def test_recovers_any_system_without_noise(name: str, seed: int, modes: int, outputs: int) -> None:
    """Exact but for rounding: eigenvalues of A and the response, from a start that is not at rest."""
    rng = np.random.default_rng(seed)
    truth, u = real_modal_form(rng, modes, outputs), rng.standard_normal((1, 600))
    y = simulated(truth, u, rng.standard_normal(2 * modes))
    span = extended_observability(project(u, y, 12), WEIGHTINGS[name])
    A, C = span.system(2 * modes)
    by_angle = lambda M: sorted(linalg.eigvals(M), key=np.angle)  # noqa: E731
    assert np.array(by_angle(A)) == pytest.approx(np.array(by_angle(truth[0])), abs=1e-6)
    system = realise(A, C, u, y)
    assert system.response(u) == pytest.approx(y, abs=1e-5 * np.abs(y).max())
    assert pytest.approx(truth[3], abs=1e-5 * np.abs(y).max()) == system.D


@every_weighting
def test_noise_free_data_hold_as_many_states_as_the_system(name: str) -> None:
    rng = np.random.default_rng(3)
    u = rng.standard_normal((1, 800))
    y = simulated(real_modal_form(rng, 2, 2), u, np.zeros(4))
    span = extended_observability(project(u, y, 10), WEIGHTINGS[name])
    assert span.singular_values[4:].max(initial=0) < 1e-7 * span.singular_values[0]


def test_more_block_rows_change_nothing_without_noise() -> None:
    rng = np.random.default_rng(5)
    truth, u = real_modal_form(rng, 3, 2), rng.standard_normal((1, 1500))
    y = simulated(truth, u, np.zeros(6))
    for rows in (5, 10, 30):
        A, C = extended_observability(project(u, y, rows), WEIGHTINGS["moesp"]).system(6)
        assert poles(A, C, 100.0).frequency == pytest.approx(poles(truth[0], truth[2], 100.0).frequency, rel=1e-8)


@every_weighting
def test_the_span_is_the_projection_recombined(name: str) -> None:
    """The basis of the modes' uncertainty: Γ = L32 X, and a left inverse of Γ."""
    rng = np.random.default_rng(11)
    u = rng.standard_normal((1, 900))
    y = simulated(real_modal_form(rng, 2, 2), u, np.zeros(4)) + 0.01 * rng.standard_normal((2, 900))
    projection = project(u, y, 8)
    span = extended_observability(projection, WEIGHTINGS[name])
    size = np.abs(span.columns).max()
    assert projection.future @ span.combination == pytest.approx(span.columns, abs=1e-9 * size)
    assert span.left_inverse @ span.columns == pytest.approx(np.eye(span.columns.shape[1]), abs=1e-9)


def test_a_superstructure_under_an_earthquake_is_identifiable() -> None:
    """Section 3: n_u = n_r, so that one regulator is enough whatever the outputs; without reference it is not."""
    assert all(is_identifiable(outputs=n, inputs=1, references=1) for n in range(1, 8))
    assert not is_identifiable(outputs=2, inputs=1, references=0)


def test_refuses_a_record_at_rest() -> None:
    with pytest.raises(IdentificationError, match="do not depend on their past"):
        extended_observability(project(np.zeros((1, 500)), np.zeros((1, 500)), 5), WEIGHTINGS["moesp"])


def any_coordinates(rng: np.random.Generator, modes: int, inputs: int, outputs: int) -> StateSpace:
    """Well separated, decaying modes, in coordinates that are not modal ones."""
    w = rng.uniform(0.9, 0.98, modes) * np.exp(1j * (np.linspace(0.2, 2.4, modes) + rng.uniform(-0.1, 0.1, modes)))
    T = linalg.qr(rng.standard_normal((2 * modes,) * 2))[0]
    return StateSpace(
        A=T @ linalg.block_diag(*([[x.real, -x.imag], [x.imag, x.real]] for x in w)) @ T.T,
        B=rng.standard_normal((2 * modes, inputs)),
        C=rng.standard_normal((outputs, 2 * modes)),
        D=rng.standard_normal((outputs, inputs)),
        initial_state=rng.standard_normal(2 * modes),
    )


def recursion(model: StateSpace, inputs: np.ndarray) -> np.ndarray:
    """The paper's equation 12, sample by sample."""
    x, outputs = model.initial_state, []
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
    model, u = any_coordinates(rng, modes, inputs, outputs), rng.standard_normal((inputs, 200))
    exact = recursion(model, u)
    assert model.response(u) == pytest.approx(exact, abs=1e-9 * np.abs(exact).max())


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), **sizes)
def test_recovers_input_feedthrough_and_start(seed: int, modes: int, inputs: int, outputs: int) -> None:
    """Exact data: the same transfer function (by its first Markov parameters) and the same response."""
    rng = np.random.default_rng(seed)
    truth, u = any_coordinates(rng, modes, inputs, outputs), rng.standard_normal((inputs, 400))
    y = recursion(truth, u)
    system = realise(truth.A, truth.C, u, y)
    size = np.abs(y).max()
    assert system.response(u) == pytest.approx(y, abs=1e-7 * size)
    assert pytest.approx(truth.D, abs=1e-7 * size) == system.D
    for power in range(4):
        markov = truth.C @ np.linalg.matrix_power(truth.A, power) @ truth.B
        assert system.C @ np.linalg.matrix_power(system.A, power) @ system.B == pytest.approx(markov, abs=1e-6 * size)


def test_is_the_least_squares_fit() -> None:
    """No other B, D and start come nearer: the misfit is orthogonal to what each entry of B can do."""
    rng = np.random.default_rng(4)
    truth, u = any_coordinates(rng, 2, 1, 2), rng.standard_normal((1, 500))
    y = recursion(truth, u) + rng.standard_normal((2, 500))
    misfit = y - realise(truth.A, truth.C, u, y).response(u)
    still = StateSpace(truth.A, np.zeros((4, 1)), truth.C, np.zeros((2, 1)), np.zeros(4))
    entries = np.eye(4)
    changed = [replace(still, B=entry[:, None]) for entry in entries] + [
        replace(still, initial_state=e) for e in entries
    ]
    for direction in (recursion(change, u) for change in changed):
        assert cosine(misfit, direction) == pytest.approx(0, abs=1e-8)
    assert [cosine(row, u[0]) for row in misfit] == pytest.approx([0, 0], abs=1e-8)


def test_unstable_modes_are_omitted() -> None:
    rng = np.random.default_rng(5)
    u, w = rng.standard_normal((1, 300)), 0.95 * np.exp(0.5j)
    y = signal.lfilter([0, 1], [1, -w], u).real
    grown = linalg.block_diag([[w.real, -w.imag], [w.imag, w.real]], [[1.0, -0.3], [0.3, 1.0]])
    result = realise(grown, np.ones((1, 4)), u, y)
    assert result.A.shape == (2, 2)
    assert result.response(u) == pytest.approx(y, abs=1e-9)
    with pytest.raises(IdentificationError, match="every mode of the system grows"):
        realise(grown[2:, 2:], np.ones((1, 2)), u, y)
