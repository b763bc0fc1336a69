"""Histories of terms against exact solutions, and against the compiled simulation of the effects made of them."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import UTC, datetime
from threading import Barrier

import numpy as np
import pytest

from core.effects import EFFECTS, add_effect, also, only
from core.errors import ModelError
from core.fitting.observation import LayerHistory, Observation
from core.model.force_response import force_response
from core.model.isolator import Conditions, Isolator
from core.sketching.law import Law, effect_of, effect_source, starts
from core.sketching.search import Placed
from core.sketching.terms import TERMS, Term, histories, scales_of

RATE, SECONDS = 200.0, 20.0
T = np.arange(0.0, SECONDS, 1 / RATE)
OMEGA, U = 3.0, 0.1


def observation() -> Observation:
    """A motion that grows to 0.1 m, with conditions that vary."""
    growth = 1 - np.exp(-T / 3)
    u = U * growth * np.sin(OMEGA * T)
    v = U * (np.exp(-T / 3) / 3 * np.sin(OMEGA * T) + growth * OMEGA * np.cos(OMEGA * T))
    conditions = Conditions(
        u_cross=0.5 * u[::-1].copy(),
        v_cross=-0.5 * v[::-1],
        axial_load=1 + 0.1 * np.sin(7 * T),
        temperature=20 + 5 * np.sin(0.1 * T),
        time=T,
        ground=0.5 * np.sin(5 * T),
    )
    layer = LayerHistory(displacement=u, velocity=v, force=u.copy(), force_std=np.ones(T.size))
    start = datetime(2024, 1, 1, tzinfo=UTC)
    return Observation("one", "x", start, RATE, layer, conditions, None, np.zeros((0, T.size)), (), transducer=True)


SEEN = observation()
SCALES = scales_of((SEEN,))


def placed() -> list[Placed]:
    """Every kind of term at the middle of its starts."""
    return [
        Placed(term, SCALES.start(term, term.starts[len(term.starts) // 2]) if term.starts else 0.0) for term in TERMS
    ]


def law_of(*terms: Placed) -> Law:
    return Law(terms, (2.0,) * len(terms), SCALES)


def named(name: str) -> Term:
    return next(term for term in TERMS if term.name == name)


@pytest.mark.accuracy
def test_every_term_is_in_the_simulation_what_it_was_in_the_search() -> None:
    """One effect of all terms, so that everything is compiled once; 1 % of each term's size: the search takes motion as
    linear between samples."""
    every = placed()
    law = law_of(*every)
    add_effect("sketch_of_everything", effect_of("sketch_of_everything", effect_source("all", law)))
    values = starts(law) | {f"force_{number}": 0.0 for number in range(1, len(every) + 1)}
    for number, one in enumerate(every, start=1):
        alone = Isolator({"sketch_of_everything": values | {f"force_{number}": 1.0}})
        simulated = force_response(
            alone, SEEN.layer.displacement, SEEN.layer.velocity, RATE, conditions=SEEN.conditions
        ).force
        (searched,) = histories(one.term, one.s, SCALES, (SEEN,))
        size = float(np.sqrt(np.mean(searched**2)))
        assert size > 0, one.term.name
        assert np.sqrt(np.mean((simulated - searched) ** 2)) < 0.01 * size, one.term.name


def test_a_maxwell_element_answers_a_sine_exactly() -> None:
    time = 0.4
    (stretch,) = histories(named("spring in series with a dashpot"), time, SCALES, (SEEN,))
    late = T > 15
    x = OMEGA * time
    exact = (
        U * x / (1 + x**2) * (x * np.sin(OMEGA * T) + np.cos(OMEGA * T)) * (1 - np.exp(-T / 3)) / SCALES.displacement
    )
    assert np.abs(stretch - exact)[late].max() < 0.01


def test_a_mass_on_the_slab_answers_a_sine_of_the_ground_exactly() -> None:
    """Den Hartog (1956): a pull of s² (1 + 2iζr) / (1 − r² + 2iζr) times the slab's absolute acceleration, r = ω s."""
    time, zeta, omega = 0.15, 0.05, 5.0
    still = LayerHistory(
        displacement=1e-9 * T, velocity=np.full(T.size, 1e-9), force=np.zeros(T.size), force_std=np.ones(T.size)
    )
    seen = replace(SEEN, layer=still)
    (pull,) = histories(named("mass that swings on the slab"), time, SCALES, (seen,))
    r = omega * time
    answer = time**2 * (1 + 2j * zeta * r) / (1 - r**2 + 2j * zeta * r)
    exact = (0.5 * np.exp(1j * omega * T) * answer).imag / SCALES.displacement
    late = T > 15  # its own swing has faded to exp(-5)
    assert (
        np.abs(pull - exact)[late].max() < 0.01 * np.abs(exact).max() + np.exp(-0.05 * 15 / time) * np.abs(exact).max()
    )


def test_a_slip_is_its_closed_form_on_first_loading() -> None:
    length = 0.02
    (z,) = histories(named("plain slip"), length, SCALES, (SEEN,))
    first = T < 0.4
    assert z[first] == pytest.approx(1 - np.exp(-SEEN.layer.displacement[first] / length), abs=1e-9)


def test_a_law_of_its_values_alone_is_the_same_law() -> None:
    law = law_of(*placed())
    values = [(one.term.name, one.s, 2.0) for one in law.placed]
    assert Law.of_terms(values, SCALES) == law


@pytest.mark.parametrize(
    ("terms", "reason"),
    [
        ([("__import__('os')", 0.0, 1.0)], "no law of a sketch has a term"),
        ([("cubic spring", 0.0, float("nan"))], "cannot have the value"),
        ([("plain slip", 0.0, 1.0)], "cannot have the value"),
        ([], "one term at least"),
    ],
)
def test_values_that_no_law_has_are_refused(terms: list[tuple[str, float, float]], reason: str) -> None:
    with pytest.raises(ModelError, match=reason):
        Law.of_terms(terms, SCALES)


@pytest.mark.parametrize("name", ["", "two words", "1st", "lambda"])
def test_a_name_that_no_effect_can_have_is_refused(name: str) -> None:
    with pytest.raises(ModelError, match="cannot be called"):
        effect_source(name, law_of(placed()[0]))


def test_threads_have_effects_of_their_own() -> None:
    """A sketch in one thread of a Dask worker narrows the effects of that thread alone."""
    before, own = dict(EFFECTS), effect_of("own", effect_source("own", law_of(Placed(named("cubic spring"), 0.0))))
    begun, seen = Barrier(2), Barrier(2)

    def narrowed() -> set[str]:
        with only(["elastic"]), also({"own": own}):
            begun.wait(30)
            seen.wait(30)
            return set(EFFECTS)

    with ThreadPoolExecutor(1) as pool:
        other = pool.submit(narrowed)
        begun.wait(30)
        here = dict(EFFECTS)
        seen.wait(30)
        assert (here, other.result()) == (before, {"elastic", "own"})


@pytest.mark.accuracy
def test_a_name_that_was_free_again_gives_the_force_of_its_new_law() -> None:
    """Sketches of one process have the same name one after the other; none of them stays."""
    before, forces = dict(EFFECTS), []
    for name in ("cubic spring", "cubic dashpot"):
        law = law_of(Placed(named(name), 0.0))
        with only(["elastic"]):
            add_effect("used_twice", effect_of("used_twice", effect_source("used_twice", law)))
            model = Isolator({"used_twice": {"force_1": 2.0}})
            forces.append(force_response(model, SEEN.layer.displacement, SEEN.layer.velocity, RATE).force)
            assert set(EFFECTS) == {"elastic", "used_twice"}
    assert dict(EFFECTS) == before
    for force, (shape, size) in zip(
        forces, [(SEEN.layer.displacement, SCALES.displacement), (SEEN.layer.velocity, SCALES.velocity)], strict=True
    ):
        assert force == pytest.approx(2 * (shape / size) ** 3, abs=1e-12)
