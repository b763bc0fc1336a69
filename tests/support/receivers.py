"""External recipients: an HTTP server and a mail server that keep what they receive."""

import ssl
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from email import message_from_bytes
from email.message import EmailMessage
from email.policy import default
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread
from time import sleep

from aiosmtpd.controller import Controller
from aiosmtpd.smtp import SMTP, AuthResult, Envelope, LoginPassword, Session

from service.demo.server import free_port


@dataclass(frozen=True, slots=True)
class PostedRequest:
    """A request as it came."""

    path: str
    headers: Mapping[str, str]
    """By name in small letters."""
    body: bytes


@dataclass(slots=True)
class WebhookServer:
    """An HTTP server that keeps what is posted, and what it answers."""

    address: str
    posted: list[PostedRequest] = field(default_factory=list)
    status: int = 204
    headers: dict[str, str] = field(default_factory=dict)
    answer: bytes = b""
    """Its body."""
    meanwhile: Callable[[], None] = lambda: None
    """Action between a post and its response."""
    drips: float = 0.0
    """s between two bytes of the answer's body."""


@contextmanager
def webhook_server(tls: ssl.SSLContext | None = None) -> Iterator[WebhookServer]:
    """One on a free port of this machine; with a context it speaks TLS."""

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            length = int(self.headers.get("content-length", "0"))
            body = self.rfile.read(length)
            if len(body) < length:  # the other side died while it spoke: nothing was said
                return
            made.posted.append(PostedRequest(self.path, {k.lower(): v for k, v in self.headers.items()}, body))
            made.meanwhile()
            try:
                self.send_response(made.status)
                for name, value in made.headers.items():
                    self.send_header(name, value)
                self.send_header("Content-Length", str(len(made.answer)))
                self.end_headers()
                for byte in made.answer if made.drips else ():
                    self.wfile.write(bytes([byte]))
                    sleep(made.drips)
                if not made.drips:
                    self.wfile.write(made.answer)
            except OSError:  # the other side has had enough
                return

        do_GET = do_POST  # noqa: N815  so that http.server finds it

        def log_message(self, format: str, *args: object) -> None:
            pass

    class Server(ThreadingHTTPServer):
        daemon_threads = True

        def handle_error(self, request: object, client_address: object) -> None:
            pass  # a client that does not trust us hangs up

    server = Server(("127.0.0.1", 0), Handler)
    if tls is not None:
        server.socket = tls.wrap_socket(server.socket, server_side=True)
    made = WebhookServer(f"{'http' if tls is None else 'https'}://localhost:{server.server_port}")
    thread = Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
    thread.start()
    try:
        yield made
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


@dataclass(slots=True)
class MailServer:
    """A mail server that keeps what it takes."""

    host: str = "127.0.0.1"
    port: int = 0
    raw: list[bytes] = field(default_factory=list)
    refuses: dict[str, str] = field(default_factory=dict)
    """Reply to a recipient, by its address."""
    after_data: str = "250 taken"
    meanwhile: Callable[[], None] = lambda: None
    """Action between a mail and its reply."""
    logins: list[str] = field(default_factory=list)
    protocols: list[str | None] = field(default_factory=list)
    """Protocol that TLS agreed on for each mail (ALPN, RFC 7301); None: no common one."""

    @property
    def mails(self) -> list[EmailMessage]:
        """Received mails, the earliest first."""
        return [message_from_bytes(one, policy=default) for one in self.raw]


class MailHandler:
    """Answers of a mail server; an object of its own, because aiosmtpd reads all attributes of a handler at every
    connection."""

    def __init__(self, box: MailServer) -> None:
        self._box = box

    async def handle_RCPT(  # noqa: N802  aiosmtpd calls it so
        self, server: SMTP, session: Session, envelope: Envelope, address: str, options: list[str]
    ) -> str:
        if address in self._box.refuses:
            return self._box.refuses[address]
        envelope.rcpt_tos.append(address)
        return "250 fine"

    async def handle_DATA(self, server: SMTP, session: Session, envelope: Envelope) -> str:  # noqa: N802
        if self._box.after_data.startswith("2"):
            assert isinstance(envelope.content, bytes)
            self._box.raw.append(envelope.content)
        self._box.protocols.append(session.ssl and session.ssl["ssl_object"].selected_alpn_protocol())
        self._box.meanwhile()
        return self._box.after_data


@contextmanager
def mail_server(tls: ssl.SSLContext | None = None, password: str | None = None) -> Iterator[MailServer]:
    """A server on a free port of this machine; with a context it requires STARTTLS, with a password a login."""
    made = MailServer()

    def login(server: SMTP, session: Session, envelope: Envelope, mechanism: str, given: LoginPassword) -> AuthResult:
        made.logins.append(given.login.decode())
        return AuthResult(success=given.password.decode() == password, handled=False)

    controller = Controller(
        MailHandler(made),
        hostname=made.host,
        port=free_port(0),
        tls_context=tls,
        require_starttls=tls is not None,
        auth_required=password is not None,
        auth_require_tls=tls is not None,
        authenticator=login if password is not None else None,
        decode_data=False,
    )
    controller.start()
    made.port = controller.port
    try:
        yield made
    finally:
        controller.stop()
