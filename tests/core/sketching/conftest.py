"""Effects of these tests disappear with them: other tests in the process go through all that there are."""

from collections.abc import Iterator

import pytest
from few_effects import few_effects


@pytest.fixture(autouse=True)
def own_library() -> Iterator[None]:
    """Only the effects of the tests' model, and those that a test adds."""
    with few_effects():
        yield
