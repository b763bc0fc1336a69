"""Progress of long work."""

from collections.abc import Callable

Progress = Callable[[str, int, int], None]
"""Called with the current step in words, the number of finished steps, and their total."""
FINE = 100
"""Steps of work whose own number of steps is not known."""


def silent(doing: str, done: int, of: int) -> None:
    """Progress that is not reported."""


def in_shares(progress: Progress) -> Callable[[str, float], None]:
    """The same, called with the share of the work that is done instead of numbers of steps."""
    return lambda doing, share: progress(doing, round(FINE * share), FINE)


def within(progress: Progress, begin: float, end: float) -> Progress:
    """Progress of a part of some work.

    Args:
        progress: of the whole.
        begin: share of the whole that is done before this part.
        end: share that is done after it.
    """

    def report(doing: str, done: int, of: int) -> None:
        progress(doing, round(FINE * (begin + (end - begin) * done / max(of, 1))), FINE)

    return report
