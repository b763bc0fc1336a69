"""What went wrong with a job, as people may read it: the log has the rest."""

import re

PATH = re.compile(r"(?<![\w.:/])(?:[A-Za-z]:)?[\\/][\w.@~+-]+(?:[\\/][\w.@~+-]*)+")
"""A path of this machine, two names deep at least."""
LONGEST = 300
"""Characters."""


def words(error: str) -> str:
    """The last line of a traceback, without the paths of this machine.

    Args:
        error: a traceback as Python writes it, or words already.
    """
    lines = error.strip().splitlines()
    return PATH.sub("(a file)", lines[-1])[:LONGEST] if lines else ""
