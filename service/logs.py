"""The log of a process of the service."""

import logging
from collections.abc import Mapping
from types import MappingProxyType

LEVELS: Mapping[str, int] = MappingProxyType(
    {"debug": logging.DEBUG, "info": logging.INFO, "warning": logging.WARNING, "error": logging.ERROR}
)
"""Logging levels by their names in the settings."""
LINE = "%(asctime)s %(levelname)s %(name)s: %(message)s"


def begin(level: int) -> None:
    """Write the log to standard error from this level on, unless logging is configured already."""
    logging.basicConfig(level=level, format=LINE)
    # a poll that is longer than the interval skips the next one, which is normal
    logging.getLogger("apscheduler").setLevel(logging.ERROR)
    for chatty in ("httpx", "alembic"):
        logging.getLogger(chatty).setLevel(logging.WARNING)
