"""The library's documents show what their examples print."""

import json
import re

import pytest
import write_library
from shared_data import needs_shared

LARGE, ROUNDED = 1e6, 2e5
"""Only a ΔBIC is so large: the difference of two sums of 10⁸, by which machines differ by so much."""
NUMBER = re.compile(r"[−-]?\d[\d,]*(?:\.\d+)?(?:e[+-]?\d+)?")


def last_place(shown: str) -> float:
    """Value of one in the last place of a whole number, which may have been rounded to tens or more; 0 of any other."""
    digits = shown.lstrip("−-").replace(",", "")
    zeros = len(digits) - len(digits.rstrip("0")) if len(digits) > 2 else 0
    return 10.0**zeros if digits.isdigit() else 0.0


def assert_alike(now: str, before: str) -> None:
    """The same words; numbers within 2 %, or whole ones within one in their last place and 10 %: machines differ."""
    assert NUMBER.sub("#", now).split() == NUMBER.sub("#", before).split()
    for one, other in zip(NUMBER.findall(now), NUMBER.findall(before), strict=True):
        values = [float(text.replace("−", "-").replace(",", "")) for text in (one, other)]
        place = min(last_place(one), last_place(other), 0.1 * abs(values[1]))
        rounded = ROUNDED if abs(values[1]) > LARGE else max(0.02, place)
        assert values[0] == pytest.approx(values[1], rel=0.02, abs=rounded), (one, other)


@pytest.mark.accuracy
def test_the_notebook_names_the_hidden_effect() -> None:
    document = json.loads(write_library.NOTEBOOK.read_text("utf-8"))
    made = write_library.notebook(document)
    assert_alike(json.dumps(made, ensure_ascii=False), json.dumps(document, ensure_ascii=False))
    assert "Hardening of the rubber (hardening) is missing." in json.dumps(made, ensure_ascii=False)


@pytest.mark.accuracy
@needs_shared
def test_the_page_shows_what_its_examples_print() -> None:
    text = write_library.PAGE.read_text("utf-8")
    assert_alike(write_library.page(text), text)
