import numpy as np
from hypothesis import given, settings, strategies as st

from core.building import fixed_base_modes
from core.identification.modes import Mode
from core.identification.tracking import Track, tracks
from core.paper import BUILDING

EXACT = fixed_base_modes(BUILDING)
seeds = st.integers(0, 2**32 - 1)


def mode(number: int, rng: np.random.Generator, softening: float = 0.0) -> Mode:
    """One of the paper's building as a record with noise shows it: 0.3 % of frequency, 3 % of shape."""
    frequency = EXACT.frequency[number] * (1 - softening)
    shape = EXACT.shape[:, number] / EXACT.shape[-1, number]
    return Mode(
        frequency=float(frequency * (1 + 0.003 * rng.standard_normal())),
        damping_ratio=float(EXACT.damping_ratio[number]),
        shape=shape + 0.03 * np.abs(shape).max() * rng.standard_normal(shape.size),
        frequency_std=float(0.003 * frequency),
    )


def spurious(rng: np.random.Generator) -> Mode:
    """A pattern in the noise: any frequency, any shape."""
    return Mode(float(rng.uniform(0.5, 12.0)), 0.03, rng.standard_normal(7))


def numbers(track: Track) -> set[int]:
    """The building's modes that belong to a track of exact frequencies."""
    return {int(np.argmin(np.abs(EXACT.frequency - one.frequency))) for one in track.modes}


@settings(max_examples=25, deadline=None)
@given(seed=seeds, largest=st.floats(0.0, 0.1), missing=st.floats(0.0, 0.4))
def test_a_mode_stays_itself_while_others_come_and_go(seed: int, largest: float, missing: float) -> None:
    """Frequencies fall by up to a tenth in strong events; up to two fifths of the modes are missing in any of them."""
    rng = np.random.default_rng(seed)
    events, truth = [], []
    for _ in range(30):
        softening = largest * rng.uniform() ** 2  # strong events are few
        kept = [number for number in range(4) if rng.uniform() >= missing]
        rng.shuffle(kept)
        events.append([mode(number, rng, softening) for number in kept])
        truth.append(kept)
    followeds = [track for track in tracks(events) if track.is_established]
    assert len(followeds) == 4
    for number, track in enumerate(followeds):
        assert {
            truth[event][events[event].index(one)] for event, one in zip(track.events, track.modes, strict=True)
        } == {number}
        assert track.events == tuple(event for event, kept in enumerate(truth) if number in kept)


@settings(max_examples=25, deadline=None)
@given(seed=seeds)
def test_patterns_in_the_noise_do_not_become_modes_of_the_building(seed: int) -> None:
    """One in every other event, anywhere. The building's own modes lose nothing to them, but at most one event each."""
    rng = np.random.default_rng(seed)
    events = [[mode(number, rng) for number in range(4)] + [spurious(rng)] * int(rng.integers(2)) for _ in range(20)]
    followeds = [track for track in tracks(events) if track.is_established]
    assert len(followeds) == 4
    assert all(len(track.events) >= 19 for track in followeds)
    assert [numbers(track) for track in followeds] == [{0}, {1}, {2}, {3}]


def test_modes_that_cross_are_distinguished_by_their_shapes() -> None:
    """Two frequencies that pass each other, as translation and torsion may."""
    rng = np.random.default_rng(1)
    first, second = np.array([1.0, 2.0, 3.0]), np.array([3.0, -1.0, -1.0])
    events = [
        [
            Mode(2.0 + 0.01 * event, 0.02, second + 0.05 * rng.standard_normal(3)),
            Mode(2.2 - 0.01 * event, 0.02, first + 0.05 * rng.standard_normal(3)),
        ]
        for event in range(20)
    ]
    followed = tracks(events)
    assert len(followed) == 2
    falling = next(track for track in followed if track.modes[0].frequency > 2.1)
    assert [one.frequency for one in falling.modes] == [2.2 - 0.01 * event for event in range(20)]


def test_a_known_frequency_is_not_confused_with_one_that_is_certain_to_differ() -> None:
    """Twenty per cent apart with standard deviations of a thousandth: two modes, even with the same shape."""
    shape = np.ones(3)
    events = [[Mode(frequency, 0.02, shape, frequency_std=0.001)] for frequency in (2.0, 2.4, 2.0, 2.4)]
    assert [track.events for track in tracks(events)] == [(0, 2), (1, 3)]
    uncertain = [[Mode(frequency, 0.02, shape, frequency_std=0.2)] for frequency in (2.0, 2.4, 2.0, 2.4)]
    assert [track.events for track in tracks(uncertain)] == [(0, 1, 2, 3)]


def test_one_event_or_none() -> None:
    rng = np.random.default_rng(2)
    assert tracks([]) == ()
    assert tracks([[], []]) == ()
    single = tracks([[mode(1, rng), mode(0, rng)]])
    assert [numbers(track) for track in single] == [{0}, {1}]
    assert all(track.is_established for track in single)
