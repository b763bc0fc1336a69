from datetime import UTC, datetime, timedelta
from itertools import pairwise

from hypothesis import given, strategies as st

from service.formats.trace import overlapping

START = datetime(2024, 1, 1, tzinfo=UTC)
Piece = tuple[int, int]
pieces = st.lists(
    st.tuples(st.integers(0, 100), st.integers(0, 20)).map(lambda start_length: (start_length[0], sum(start_length)))
)


def span(piece: Piece) -> tuple[datetime, datetime]:
    return START + timedelta(seconds=piece[0]), START + timedelta(seconds=piece[1])


def test_files_of_one_earthquake_are_one_group() -> None:
    earlier, later = [(0, 40), (2, 41), (39, 60)], [(100, 120)]
    assert overlapping([*later, *earlier], span) == (tuple(earlier), tuple(later))


def test_a_long_file_holds_short_ones_together() -> None:
    assert overlapping([(0, 100), (10, 20), (50, 60)], span) == (((0, 100), (10, 20), (50, 60)),)


def test_a_pause_within_the_slack_does_not_part_them() -> None:
    cut = [(0, 10), (13, 20)]
    assert len(overlapping(cut, span)) == 2
    assert len(overlapping(cut, span, timedelta(seconds=3))) == 1


def test_nothing_makes_no_group() -> None:
    assert overlapping([], span) == ()


@given(pieces=pieces, slack=st.integers(0, 10), seed=st.randoms(use_true_random=False))
def test_every_piece_is_in_one_group_whatever_their_order(pieces: list[Piece], slack: int, seed: object) -> None:
    shuffled = pieces.copy()
    seed.shuffle(shuffled)  # type: ignore[attr-defined]
    groups = overlapping(shuffled, span, timedelta(seconds=slack))
    assert [piece for group in groups for piece in group] == sorted(pieces)
    assert groups == overlapping(pieces, span, timedelta(seconds=slack))
    for before, after in pairwise(groups):
        assert after[0][0] - max(end for _, end in before) > slack
