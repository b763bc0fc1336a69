"""Times in text form (RFC 3339)."""

import re
from datetime import UTC, datetime

RFC_3339 = re.compile(r"\d{4}-\d\d-\d\d([Tt ]\d\d:\d\d(:\d\d(\.\d+)?)?([Zz]|[+-]\d\d:\d\d)?)?", re.ASCII)


def read_time(text: object) -> datetime:
    """A time in UTC; text without a zone is in UTC.

    Raises:
        ValueError: the text is not a time of RFC 3339.
    """
    if not isinstance(text, str) or not RFC_3339.fullmatch(text):
        raise ValueError("give a date or a time such as 2010-02-27T06:34:11Z")
    time = datetime.fromisoformat(text.upper())
    try:
        return time.replace(tzinfo=UTC) if time.tzinfo is None else time.astimezone(UTC)
    except OverflowError:  # at the ends of the calendar the zone does not matter
        return time.replace(tzinfo=UTC)
