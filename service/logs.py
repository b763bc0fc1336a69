"""The log of a process of the service, as text or as JSON, and what its lines are about."""

import json
import logging
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from datetime import UTC, datetime
from types import MappingProxyType

LEVELS: Mapping[str, int] = MappingProxyType(
    {"debug": logging.DEBUG, "info": logging.INFO, "warning": logging.WARNING, "error": logging.ERROR}
)
"""Logging levels by their names in the settings."""
LINE = "%(asctime)s %(levelname)s %(name)s: %(message)s"
_SUBJECT: ContextVar[Mapping[str, object]] = ContextVar("subject", default=MappingProxyType({}))


def begin(level: int, style: str) -> None:
    """Write the log to standard error from this level on, unless logging is configured already.

    Args:
        level: the lowest one.
        style: `text`, or `json` for one JSON object a line.
    """
    handler = logging.StreamHandler()
    handler.setFormatter(JsonLine() if style == "json" else logging.Formatter(LINE))
    logging.basicConfig(level=level, handlers=[handler])
    # a poll that is longer than the interval skips the next one, which is normal
    logging.getLogger("apscheduler").setLevel(logging.ERROR)
    for chatty in ("httpx", "alembic"):
        logging.getLogger(chatty).setLevel(logging.WARNING)


@contextmanager
def about(**subject: object) -> Iterator[None]:
    """Lines within are about these: numbers of events and jobs, codes of buildings. None is left out."""
    token = _SUBJECT.set(_with(subject))
    try:
        yield
    finally:
        _SUBJECT.reset(token)


def are_about(**subject: object) -> None:
    """All later lines of this context, such as the task of a request, are about these."""
    _SUBJECT.set(_with(subject))


def _with(subject: Mapping[str, object]) -> Mapping[str, object]:
    return {**_SUBJECT.get(), **{name: value for name, value in subject.items() if value is not None}}


class JsonLine(logging.Formatter):
    """A line of the log as a JSON object: time, level, logger, message, process, thread, subject, exception."""

    def format(self, record: logging.LogRecord) -> str:
        """The record as one line."""
        time = datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds")
        line: dict[str, object] = {
            "time": time.replace("+00:00", "Z"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
            "process": record.process,
            "thread": record.threadName,
            **_SUBJECT.get(),
        }
        if record.exc_info:
            line["exception"] = self.formatException(record.exc_info)
        return json.dumps(line, ensure_ascii=False, default=str)
