"""Times as people and programs write them (RFC 3339)."""

import re
from datetime import UTC, datetime

RFC_3339 = re.compile(r"\d{4}-\d\d-\d\d([Tt ]\d\d:\d\d(:\d\d(\.\d+)?)?([Zz]|[+-]\d\d:\d\d)?)?", re.ASCII)


def read_time(written: object) -> datetime:
    """An aware time; UTC where no zone is written.

    Raises:
        ValueError: it is not written as in RFC 3339.
    """
    if not isinstance(written, str) or not RFC_3339.fullmatch(written):
        raise ValueError("a date or a time as in 2010-02-27T06:34:11Z is wanted")
    time = datetime.fromisoformat(written.upper())
    try:
        return time.replace(tzinfo=UTC) if time.tzinfo is None else time.astimezone(UTC)
    except OverflowError:  # at the ends of the calendar the zone does not matter
        return time.replace(tzinfo=UTC)
