"""Effects of these tests disappear with them: other tests in the process go through all that there are."""

from collections.abc import Iterator

import pytest

from core import effects


@pytest.fixture(autouse=True)
def only_the_library_afterwards() -> Iterator[None]:
    """Remove the effects that a test has added."""
    before = set(effects.EFFECTS)
    yield
    for name in set(effects.EFFECTS) - before:
        del vars(effects)["_known"][name]
