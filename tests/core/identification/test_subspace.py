import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import linalg

from core.arrays import Matrix
from core.errors import IdentificationError
from core.identification.modes import poles
from core.identification.projection import project
from core.identification.realisation import realise
from core.identification.subspace import WEIGHTINGS, is_identifiable, observability_span

every_weighting = pytest.mark.parametrize("name", sorted(WEIGHTINGS))
System = tuple[Matrix, Matrix, Matrix, Matrix]


def system(rng: np.random.Generator, modes: int, outputs: int) -> System:
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
    truth, u = system(rng, modes, outputs), rng.standard_normal((1, 600))
    y = simulated(truth, u, rng.standard_normal(2 * modes))
    span = observability_span(project(u, y, 12), WEIGHTINGS[name])
    A, C = span.system(2 * modes)
    by_angle = lambda M: sorted(linalg.eigvals(M), key=np.angle)  # noqa: E731
    assert np.array(by_angle(A)) == pytest.approx(np.array(by_angle(truth[0])), abs=1e-6)
    found = realise(A, C, u, y)
    assert found.response(u) == pytest.approx(y, abs=1e-5 * np.abs(y).max())
    assert pytest.approx(truth[3], abs=1e-5 * np.abs(y).max()) == found.D


@every_weighting
def test_noise_free_data_hold_as_many_states_as_the_system(name: str) -> None:
    rng = np.random.default_rng(3)
    u = rng.standard_normal((1, 800))
    y = simulated(system(rng, 2, 2), u, np.zeros(4))
    span = observability_span(project(u, y, 10), WEIGHTINGS[name])
    assert span.singular_values[4:].max(initial=0) < 1e-7 * span.singular_values[0]


def test_more_block_rows_change_nothing_without_noise() -> None:
    rng = np.random.default_rng(5)
    truth, u = system(rng, 3, 2), rng.standard_normal((1, 1500))
    y = simulated(truth, u, np.zeros(6))
    for rows in (5, 10, 30):
        A, C = observability_span(project(u, y, rows), WEIGHTINGS["moesp"]).system(6)
        assert poles(A, C, 100.0).frequency == pytest.approx(poles(truth[0], truth[2], 100.0).frequency, rel=1e-8)


@every_weighting
def test_the_span_is_the_projection_recombined(name: str) -> None:
    """What the modes' uncertainty rests on: Γ = L32 X, and a left inverse of Γ."""
    rng = np.random.default_rng(11)
    u = rng.standard_normal((1, 900))
    y = simulated(system(rng, 2, 2), u, np.zeros(4)) + 0.01 * rng.standard_normal((2, 900))
    projection = project(u, y, 8)
    span = observability_span(projection, WEIGHTINGS[name])
    size = np.abs(span.columns).max()
    assert projection.future @ span.combination == pytest.approx(span.columns, abs=1e-9 * size)
    assert span.left_inverse @ span.columns == pytest.approx(np.eye(span.columns.shape[1]), abs=1e-9)


def test_a_superstructure_under_an_earthquake_is_identifiable() -> None:
    """Section 3: n_u = n_r, so that one regulator is enough whatever the outputs; without reference it is not."""
    assert all(is_identifiable(outputs=n, inputs=1, references=1) for n in range(1, 8))
    assert not is_identifiable(outputs=2, inputs=1, references=0)


def test_refuses_a_record_at_rest() -> None:
    with pytest.raises(IdentificationError, match="do not depend on their past"):
        observability_span(project(np.zeros((1, 500)), np.zeros((1, 500)), 5), WEIGHTINGS["moesp"])
