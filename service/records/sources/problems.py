"""Problems with a server or its answers, in words, with the remedy."""

import re
import socket
import ssl
from http import HTTPStatus

from service import parsing
from service.formats import FormatError, UnknownUnitError
from service.parsing import Limits, ParserDiedError, ParserFailedError

LOCATION = "location in the building file"
REFUSED = f"check that the server runs, and the host and port of {LOCATION}"
HELPS = {
    HTTPStatus.UNAUTHORIZED: f"the user name or the password is missing or wrong; correct it in {LOCATION}",
    HTTPStatus.FORBIDDEN: f"the server denies access; ask its operator, or correct {LOCATION}",
    HTTPStatus.NOT_FOUND: f"nothing is served at this path; correct {LOCATION}",
    HTTPStatus.PROXY_AUTHENTICATION_REQUIRED: "the proxy between here and there needs a password; ask its operator",
}
"""Remedies for answers that will not change by themselves."""
NAMELESS = "its name is not known"
CLOSED = "the connection is refused, as no server listens at this port"
"""Reasons why a server cannot be reached."""
TITLE = re.compile(rb"<title[^>]*>(.*?)</title>", re.IGNORECASE | re.DOTALL)


def unreachable(address: object, error: BaseException) -> tuple[str, str]:
    """The problem (`... cannot be reached: ...`) and its remedy, from the system's error behind an exception."""
    for cause in _causes(error):
        if isinstance(cause, ssl.SSLError):
            problem, helps = _tls(cause)
            return f"{address} cannot be reached: {problem}", helps
        if isinstance(cause, socket.gaierror):
            return (
                f"{address} cannot be reached: {NAMELESS}",
                f"check {LOCATION}, and the name server (DNS)",
            )
        if isinstance(cause, ConnectionRefusedError):
            return f"{address} cannot be reached: {CLOSED}", REFUSED
        if isinstance(cause, ConnectionResetError):
            return f"{address} broke off its answer", REFUSED
        if isinstance(cause, OSError) and cause.strerror:
            return f"{address} cannot be reached: {_of_system(cause.strerror)}", REFUSED
    return (
        f"{address} broke off its answer ({str(error) or type(error).__name__})",
        "it is tried again at the next poll",
    )


def _of_system(words: str) -> str:
    return f"the network says {words!r}"


def refusal(status: int, reason: str) -> str:
    """`answered 401 Unauthorized; ...` with the remedy."""
    helps = HELPS.get(HTTPStatus(status) if status in set(HTTPStatus) else HTTPStatus.OK)
    return f"answered {status} {reason}; {helps or f'correct {LOCATION}'}"


def is_page(body: bytes) -> bool:
    """True if a web page came in place of data, from a login form or a server under maintenance."""
    return body[:256].lstrip().lower().startswith((b"<!doctype html", b"<html"))


def titled(page: bytes) -> str:
    """`an HTML page ('Log in')`, from the beginning of the page."""
    title = TITLE.search(page[:4096])
    named = " ".join(title[1].decode(errors="replace").split())[:100] if title else ""
    return f"an HTML page ({named!r})" if named else "an HTML page without a title"


def incomplete(name: str, body: bytes, limits: Limits) -> str | None:
    """The reason why a file of waveforms is incomplete or damaged; None if it is whole.

    A missing unit is no damage. Neither is a file that exceeds the parser's limits: it is rejected on intake after a
    few attempts, and must not be fetched for ever.
    """
    try:
        parsing.read(name, body, {}, limits)
    except (UnknownUnitError, ParserDiedError, ParserFailedError):
        return None
    except FormatError as error:
        return str(error)
    return None


def _tls(error: ssl.SSLError) -> tuple[str, str]:
    if isinstance(error, ssl.SSLCertVerificationError):
        return (
            f"its TLS certificate is not trusted ({error.verify_message.rstrip('.')})",
            f"give the server a certificate for this host that is trusted here, or correct {LOCATION}",
        )
    if error.reason in ("WRONG_VERSION_NUMBER", "RECORD_LAYER_FAILURE", "HTTP_REQUEST"):
        return (
            "it does not speak TLS at this port",
            f"http:// in place of https://, or another port, in {LOCATION}",
        )
    return f"TLS failed ({error.reason or error})", f"check that https:// and the port of {LOCATION} are right"


def _causes(error: BaseException | None) -> list[BaseException]:
    """An error and its causes, the innermost first."""
    causes: list[BaseException] = []
    while error is not None and error not in causes:
        causes.append(error)
        error = error.__cause__ or error.__context__
    return causes[::-1]
