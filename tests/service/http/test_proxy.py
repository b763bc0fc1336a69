"""The proxy of docs/operate/security.md, as a real nginx: it makes no one an admin."""

import re
import shutil
import socket
import ssl
import subprocess
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from time import monotonic, sleep

import httpx
import pytest
import trustme
from api_server import api_server
from sqlalchemy.orm import Session, sessionmaker

from service.access import keys
from service.access.auth import SAFE_COOKIE
from service.access.roles import Role
from service.access.tables import AuditEntry

NGINX = shutil.which("nginx") or "/usr/sbin/nginx"
DOCUMENT = Path(__file__).parents[3] / "docs" / "operate" / "security.md"

pytestmark = pytest.mark.skipif(not Path(NGINX).exists(), reason="no nginx is installed")


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as door:
        return int(door.getsockname()[1])


@pytest.fixture(scope="module")
def key(stored: sessionmaker[Session]) -> str:
    with stored.begin() as session:
        return keys.create(session, "behind the proxy", Role.admin, datetime.now(UTC))


@pytest.fixture(scope="module")
def proxy(url: str, key: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.Client]:
    """A client at nginx, as the document configures it, with its ports, name and certificate exchanged."""
    folder = tmp_path_factory.mktemp("nginx")
    authority, secure, plain = trustme.CA(), free_port(), free_port()
    issued = authority.issue_cert("localhost")
    issued.private_key_pem.write_to_path(folder / "key.pem")
    issued.cert_chain_pems[0].write_to_path(folder / "cert.pem")
    authority.cert_pem.write_to_path(folder / "authority.pem")
    trusted = ssl.create_default_context(cafile=str(folder / "authority.pem"))
    public = f"https://localhost:{secure}"
    with api_server(url, visitor=None, trusted_proxies=("127.0.0.1",), public_url=public) as address:
        block = re.search(r"```nginx\n(.*?)```", DOCUMENT.read_text("utf-8"), re.DOTALL)
        assert block is not None
        text = block[1]
        for shown, real in (
            ("http://127.0.0.1:8000", address),
            ("listen 443", f"listen 127.0.0.1:{secure}"),
            ("listen 80", f"listen 127.0.0.1:{plain}"),
            ("/etc/ssl/menshin/fullchain.pem", str(folder / "cert.pem")),
            ("/etc/ssl/menshin/privkey.pem", str(folder / "key.pem")),
            ("menshin.example.org", "localhost"),
        ):
            assert shown in text, shown
            text = text.replace(shown, real)
        paths = "".join(
            f"{name}_temp_path {folder}/{name};" for name in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
        )
        (folder / "nginx.conf").write_text(
            f"daemon off; pid {folder}/pid; error_log stderr; events {{}}\nhttp {{ access_log off; {paths}\n{text}}}"
        )
        command = [NGINX, "-e", "stderr", "-c", str(folder / "nginx.conf")]
        with (folder / "output").open("w") as output, subprocess.Popen(command, stderr=output) as running:
            try:
                with httpx.Client(base_url=public, verify=trusted, timeout=30) as api:
                    wait_for(api, folder / "output")
                    yield api
            finally:
                running.terminate()


def wait_for(api: httpx.Client, output: Path) -> None:
    end = monotonic() + 60
    while True:
        try:
            assert api.get("/healthz").status_code == 200
        except httpx.TransportError:
            assert monotonic() < end, output.read_text()
            sleep(0.1)
        else:
            return


def test_no_one_is_let_in_for_coming_through_it(proxy: httpx.Client) -> None:
    for headers in ({}, {"Host": "127.0.0.1"}, {"X-Forwarded-For": "127.0.0.1"}):
        assert proxy.get("/api/v1/buildings", headers=headers).status_code == 401
        assert proxy.get("/", headers=headers).status_code == 303


def test_a_browser_logs_in_by_https_with_a_cookie_for_this_host_alone(
    proxy: httpx.Client, key: str, stored: sessionmaker[Session]
) -> None:
    origin = str(proxy.base_url).rstrip("/")
    answer = proxy.post("/login", data={"key": key}, headers={"Origin": origin, "X-Forwarded-For": "192.0.2.1"})
    assert answer.status_code == 303
    assert answer.headers["set-cookie"].startswith(f"{SAFE_COOKIE}=")
    assert answer.headers["strict-transport-security"] == "max-age=31536000"
    assert proxy.get("/").status_code == 200
    with stored() as session:
        assert {entry.address for entry in session.query(AuditEntry)} == {"127.0.0.1"}, "not what the client wrote"
