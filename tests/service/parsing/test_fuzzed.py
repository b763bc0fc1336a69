"""Spoilt files of every format end within their limits as a record or as a refusal in words, and as nothing else."""

from collections.abc import Callable
from pathlib import Path

import pytest
from fuzz_inputs import BUILDING, FILES, GAINS, spoilt
from hypothesis import HealthCheck, given, seed, settings, strategies as st

from core.record import Channel
from service import parsing
from service.buildings import description
from service.buildings.description import BuildingFileError
from service.formats import FormatError, of_building
from service.parsing import Limits

LIMITS = Limits(5.0, 2**28)
LONGEST = 5000
"""Characters of a refusal: people read it."""
SLOW = (HealthCheck.too_slow, HealthCheck.data_too_large)
EXAMPLES = settings(max_examples=150, deadline=None, database=None, suppress_health_check=SLOW)

pytestmark = pytest.mark.slow


def refusal(reading: Callable[[], object]) -> str:
    """Message about a rejected file; None for an accepted one. Any other exception propagates."""
    try:
        _in_time(reading)
    except (FormatError, BuildingFileError) as error:
        return str(error) or "nothing is said"
    return ""


def _in_time(reading: Callable[[], object]) -> None:
    """Read a file, once more if its time was up: a busy machine may have held up its parser.

    A file that takes too long does so each time.
    """
    try:
        reading()
    except parsing.ParserDiedError as error:
        if "s to be read" not in str(error):
            raise
        reading()


@pytest.mark.parametrize("kind", FILES)
@seed(12)
@EXAMPLES
@given(data=st.data())
def test_a_spoilt_file_is_a_record_or_a_refusal(kind: str, data: st.DataObject) -> None:
    spoilt_file = data.draw(spoilt(FILES[kind]))

    def taken() -> None:
        contents = parsing.read("a", spoilt_file, GAINS, LIMITS)
        channels = [Channel(trace.channel, "roof", trace.quantity, "x") for trace in contents.traces]
        for trace in of_building(contents.traces, channels):
            assert trace.span[0] <= trace.span[1]

    assert len(refusal(taken)) < LONGEST


@pytest.mark.parametrize("kind", ["miniSEED", "SAC"])
@seed(12)
@EXAMPLES
@given(data=st.data())
def test_the_times_of_a_spoilt_file_are_known_or_refused(kind: str, data: st.DataObject) -> None:
    spoilt_file = data.draw(spoilt(FILES[kind]))

    def known() -> None:
        for piece in parsing.covered("a", spoilt_file, LIMITS):
            assert piece.start <= piece.end

    assert len(refusal(known)) < LONGEST


@seed(12)
@EXAMPLES
@given(data=st.data())
def test_a_spoilt_building_file_is_a_building_or_a_list_of_problems(data: st.DataObject) -> None:
    text = data.draw(spoilt(BUILDING)).decode("utf-8", "replace")
    assert refusal(lambda: description.read(text, Path("/"))) != "nothing is said"
