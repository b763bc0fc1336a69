"""The log of a process of ours."""

import logging
from collections.abc import Mapping
from types import MappingProxyType

LEVELS: Mapping[str, int] = MappingProxyType(
    {"debug": logging.DEBUG, "info": logging.INFO, "warning": logging.WARNING, "error": logging.ERROR}
)
"""Levels by their names in the settings."""
LINE = "%(asctime)s %(levelname)s %(name)s: %(message)s"


def begin(level: int) -> None:
    """Write it to the standard error from this level on, unless it is written already."""
    logging.basicConfig(level=level, format=LINE)
    logging.getLogger("apscheduler").setLevel(logging.ERROR)  # a look longer than the interval skips one: no fault
    logging.getLogger("httpx").setLevel(logging.WARNING)
