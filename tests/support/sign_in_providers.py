"""Sign-in providers on this machine: a real one as a process, and one that lies as a test says."""

import hmac
import json
import socket
import subprocess
import sys
import time
from base64 import urlsafe_b64encode
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler
from threading import Thread
from typing import Any
from urllib.parse import parse_qs, urlsplit

import httpx
from authlib.oauth2.rfc7636 import create_s256_code_challenge
from joserfc import jwt
from joserfc.jwk import ECKey
from monitoring_server import QuietServer

CLIENT = "menshin"
STARTED = 20.0
"""s for the provider's process to start."""


@contextmanager
def real_provider(*people: Mapping[str, object]) -> Iterator[str]:
    """Issuer of an oidc-provider-mock that knows these people, each by its claims."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    known = [part for one in people for part in ("--user-claims", json.dumps(one))]
    command = [sys.executable, "-m", "oidc_provider_mock", "--port", str(port), "--require-nonce", *known]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    issuer, end = f"http://127.0.0.1:{port}", time.monotonic() + STARTED
    try:
        while time.monotonic() < end and process.poll() is None:
            try:
                httpx.get(f"{issuer}/jwks", trust_env=False)
                break
            except httpx.ConnectError:
                time.sleep(0.05)
        yield issuer
    finally:
        process.terminate()
        process.wait()


def signed_in_at(address: str, subject: str) -> str:
    """Where a provider sends a browser back to, after a person has signed in at the address that begins a sign-in."""
    answer = httpx.post(address, data={"sub": subject}, trust_env=False)
    assert answer.status_code == 302, answer.text
    return answer.headers["location"]


@dataclass
class LyingProvider:
    """A provider whose answers a test changes; it checks PKCE and hands each code out once, as an honest one."""

    issuer: str = ""
    metadata: dict[str, Any] = field(default_factory=dict)
    """Members that replace those of the honest discovery document."""
    claims: dict[str, Any] = field(default_factory=dict)
    """Claims that replace the honest ones; None removes a claim."""
    header: dict[str, Any] = field(default_factory=lambda: {"alg": "ES256"})
    signing: ECKey = field(default_factory=lambda: ECKey.generate_key("P-256", {"kid": "one"}))
    published: ECKey | None = None
    """The key at the address of the keys, if it is another than the signing one."""
    delay: float = 0.0
    token: str | None = None
    """The ID token, if it is not to be a new one."""
    sent: dict[str, dict[str, str]] = field(default_factory=dict)
    """Parameters of the authorization request by code."""

    def sign_in(self, address: str) -> str:
        """Path and query by which the browser comes back from the address that begins a sign-in."""
        asked = {name: one[0] for name, one in parse_qs(urlsplit(address).query).items()}
        code = f"code-{len(self.sent)}"
        self.sent[code] = asked
        return f"/login/callback?state={asked['state']}&code={code}"

    def answer(self, path: str, body: Mapping[str, str]) -> tuple[int, Any]:
        """Status and content of an answer."""
        time.sleep(self.delay)
        match path:
            case "/.well-known/openid-configuration":
                addresses = {"authorization_endpoint": "/authorize", "token_endpoint": "/token", "jwks_uri": "/keys"}
                honest = {name: f"{self.issuer}{one}" for name, one in addresses.items()}
                return 200, {"issuer": self.issuer, **honest} | self.metadata
            case "/keys":
                return 200, {"keys": [(self.published or self.signing).as_dict(private=False)]}
            case "/token":
                return self._token(body)
        return 404, {}

    def signed(self, claims: dict[str, Any]) -> str:
        """An ID token; by HS256 it is signed with the published key, which everyone knows, as if it were a secret."""
        if self.header["alg"] != "HS256":
            return jwt.encode(self.header, claims, self.signing, algorithms=["ES256", "none"])
        head, body = (urlsafe_b64encode(json.dumps(one).encode()).rstrip(b"=") for one in (self.header, claims))
        signature = hmac.digest(self.signing.as_pem(private=False), head + b"." + body, "sha256")
        return b".".join((head, body, urlsafe_b64encode(signature).rstrip(b"="))).decode()

    def _token(self, body: Mapping[str, str]) -> tuple[int, Any]:
        asked = self.sent.pop(body.get("code", ""), None)
        if asked is None or asked["code_challenge"] != create_s256_code_challenge(body["code_verifier"]):
            return 400, {"error": "invalid_grant"}
        now = int(time.time())
        honest = {"iss": self.issuer, "aud": CLIENT, "sub": "1", "iat": now, "exp": now + 60, "nonce": asked["nonce"]}
        claims = honest | {"preferred_username": "hana", "groups": ["engineers"]} | self.claims
        kept = {name: one for name, one in claims.items() if one is not None}
        token = self.token or self.signed(kept)
        return 200, {"access_token": "a", "token_type": "Bearer", "id_token": token}


@contextmanager
def lying_provider() -> Iterator[LyingProvider]:
    """A provider that is honest until a test changes it."""
    provider = LyingProvider()

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self._answer({})

        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"])).decode()
            self._answer({name: one[0] for name, one in parse_qs(body).items()})

        def _answer(self, body: Mapping[str, str]) -> None:
            status, content = provider.answer(urlsplit(self.path).path, body)
            written = content if isinstance(content, bytes) else json.dumps(content).encode()
            self.send_response(status)
            self.send_header("Content-Length", str(len(written)))
            self.end_headers()
            self.wfile.write(written)

        def log_message(self, *_: object) -> None:
            """Nothing."""

    server = QuietServer(("127.0.0.1", 0), Handler)
    provider.issuer = f"http://127.0.0.1:{server.server_port}"
    thread = Thread(target=server.serve_forever, args=(0.01,))
    thread.start()
    try:
        yield provider
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
