"""What runs in the process that speaks to a chat service: a letter in, what came of it out, as JSON.

An audit hook (PEP 578) sees every connection before it is made, whichever library makes it and after whichever
redirect: what is not public, and not allowed, is refused, and so is what would stay on this machine.
"""

import logging
import sys
from base64 import b64decode
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from typing import Any

import apprise
import orjson
from apprise.attachment.memory import AttachMemory

from service.notify.addresses import Reach, may_be_reached
from service.notify.outcome import Answer, one_line

TYPES = {
    "normal": apprise.NotifyType.SUCCESS,
    "note": apprise.NotifyType.INFO,
    "warning": apprise.NotifyType.WARNING,
    "alarm": apprise.NotifyType.FAILURE,
}
HERE = frozenset({"subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "os.forkpty", "syslog.syslog"})
"""Audit events of what would be done on this machine, by another program or its log."""


@dataclass(slots=True)
class Guard:
    """Refuses connections to the inside, and remembers that it did."""

    reach: Reach
    refused: list[str] = field(default_factory=list)

    def __call__(self, event: str, arguments: tuple[Any, ...]) -> None:
        """Of an audit event.

        Raises:
            PermissionError: it must not be.
        """
        if event in HERE:
            self._refuse(f"{event}, which stays on this machine")
        if event in ("socket.connect", "socket.sendto"):
            address = arguments[1]
            if not isinstance(address, tuple) or not may_be_reached(str(address[0]), self.reach):
                self._refuse(f"{address[0] if isinstance(address, tuple) else 'a local socket'}, which is not public")

    def _refuse(self, what: str) -> None:
        self.refused.append(what)
        raise PermissionError(f"refused: {what}")


class Said(logging.Handler):
    """What Apprise says went wrong."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Keep it."""
        self.lines.append(record.getMessage())


def sent(given: dict[str, Any]) -> Answer:
    """Send what the process was given; afterwards it connects to public addresses only."""
    service = apprise.Apprise.instantiate(given["address"])
    if service is None:
        return Answer("not_taken", "Apprise knows no such service, or not with such an address", is_final=True)
    said, guard = Said(), Guard(Reach(tuple(given["allowed"])))
    logging.getLogger("apprise").addHandler(said)
    sys.addaudithook(guard)
    picture = given["picture"] and apprise.AppriseAttachment(
        AttachMemory(b64decode(given["picture"]), "loop.png", "image/png")  # type: ignore[no-untyped-call]
    )
    done = False
    with suppress(PermissionError):  # the guard's, where the service does not take it for a broken connection
        done = service.notify(
            body=given["body"], title=given["title"], notify_type=TYPES[given["severity"]], attach=picture
        )
    if guard.refused:
        return Answer("not_taken", f"refused: {guard.refused[0]}; notify.allowed_private_hosts can allow a network")
    return Answer("delivered", "taken") if done else Answer("unknown", one_line("; ".join(said.lines) or "no answer"))


if __name__ == "__main__":
    answer = sent(orjson.loads(sys.stdin.buffer.read()))
    sys.stdout.buffer.write(orjson.dumps(asdict(answer)))
