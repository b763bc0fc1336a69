"""The process that sends to a chat service: a message in, the result out, as JSON.

An audit hook (PEP 578) checks every connection before it is made, whatever library makes it and after any redirect:
addresses that are neither public nor allowed are refused, and so are other programs and the log of this machine.
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

from service.notify.channels import DeliveryResult, one_line
from service.notify.channels.outbound_http import Reach, may_be_reached

TYPES = {
    "normal": apprise.NotifyType.SUCCESS,
    "note": apprise.NotifyType.INFO,
    "warning": apprise.NotifyType.WARNING,
    "alarm": apprise.NotifyType.FAILURE,
}
HERE = frozenset({"subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "os.forkpty", "syslog.syslog"})
"""Audit events of other programs, and of the log, of this machine."""


@dataclass(slots=True)
class Guard:
    """Refuses connections to inside addresses, and records them."""

    reach: Reach
    refused: list[str] = field(default_factory=list)

    def __call__(self, event: str, arguments: tuple[Any, ...]) -> None:
        """Check an audit event.

        Raises:
            PermissionError: it is not allowed.
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


class Warnings(logging.Handler):
    """Warnings of Apprise."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Store the line."""
        self.lines.append(record.getMessage())


def sent(request: dict[str, Any]) -> DeliveryResult:
    """Send the message of a request; from then on the process connects to allowed addresses only."""
    service = apprise.Apprise.instantiate(request["address"])
    if service is None:
        return DeliveryResult("not_taken", "Apprise does not support such a service or address", is_final=True)
    warnings, guard = Warnings(), Guard(Reach(tuple(request["allowed"])))
    logging.getLogger("apprise").addHandler(warnings)
    sys.addaudithook(guard)
    picture = request["picture"] and apprise.AppriseAttachment(
        AttachMemory(b64decode(request["picture"]), "loop.png", "image/png")  # type: ignore[no-untyped-call]
    )
    is_sent = False
    with suppress(PermissionError):  # of the guard, unless the service treats it as a broken connection
        is_sent = service.notify(
            body=request["body"], title=request["title"], notify_type=TYPES[request["severity"]], attach=picture
        )
    if guard.refused:
        return DeliveryResult(
            "not_taken", f"refused: {guard.refused[0]}; notify.allowed_private_hosts can allow a network"
        )
    return (
        DeliveryResult("delivered", "accepted")
        if is_sent
        else DeliveryResult("unknown", one_line("; ".join(warnings.lines) or "no answer"))
    )


if __name__ == "__main__":
    result = sent(orjson.loads(sys.stdin.buffer.read()))
    sys.stdout.buffer.write(orjson.dumps(asdict(result)))
