"""Addresses that messages may go to: every trick to reach inside, against a real server that must not be reached."""

import socket
import ssl
import sys
from collections.abc import Iterator
from dataclasses import replace
from ipaddress import IPv4Address, IPv6Address
from pathlib import Path
from time import monotonic, sleep
from urllib.parse import urlsplit

import pytest
import trustme
from hypothesis import given, strategies as st
from receivers import WebhookServer, webhook_server

from service.notify.channels import DeliveryResult
from service.notify.channels.outbound_http import MOST_BYTES, Reach, may_be_reached, posted

OPEN = Reach(allowed=("localhost", "127.0.0.0/8"), plain_http=True)
SHUT = Reach(plain_http=True)


@pytest.fixture
def there() -> Iterator[WebhookServer]:
    with webhook_server() as server:
        yield server


def post(url: str, reach: Reach = OPEN, seconds: float = 5.0) -> DeliveryResult:
    return posted(url, {"content-type": "text/plain", "X-Name": "ä"}, "ü".encode(), reach, seconds)


def port(server: WebhookServer) -> int:
    return urlsplit(server.address).port or 0


def test_what_is_posted_arrives_as_it_is(there: WebhookServer) -> None:
    there.answer = b"taken\x00\r\n with thanks"
    there.status = 200
    answer = post(f"{there.address}/a%20path?b=c", OPEN)
    assert answer == DeliveryResult("delivered", "200 taken with thanks")
    [one] = there.posted
    assert (one.path, one.body) == ("/a%20path?b=c", "ü".encode())
    assert one.headers["host"] == f"localhost:{port(there)}"
    assert "authorization" not in one.headers


def test_a_name_and_a_password_are_sent_as_such(there: WebhookServer) -> None:
    post(there.address.replace("//", "//user:p%40ss@"))
    assert there.posted[0].headers["authorization"] == "Basic dXNlcjpwQHNz"
    assert "@" not in there.posted[0].headers["host"]


TRICKS = [
    "http://127.0.0.1:{port}/",
    "http://localhost:{port}/",
    "http://LOCALHOST.:{port}/",
    "http://2130706433:{port}/",
    "http://0x7f000001:{port}/",
    "http://0x7f.1:{port}/",
    "http://127.1:{port}/",
    "http://017700000001:{port}/",
    "http://0:{port}/",
    "http://0.0.0.0:{port}/",
    "http://[::1]:{port}/",
    "http://[::]:{port}/",
    "http://[::ffff:127.0.0.1]:{port}/",
    "http://[::ffff:7f00:1]:{port}/",
    "http://[::127.0.0.1]:{port}/",
    "http://[64:ff9b::7f00:1]:{port}/",
    "http://[2002:7f00:1::]:{port}/",
    "http://example.org@127.0.0.1:{port}/",
    "http://127.0.0.1:{port}#@example.org/",
    "http://①②⑦.⓪.⓪.①:{port}/",
    "http://169.254.169.254/latest/meta-data/",
]


@pytest.mark.parametrize("trick", TRICKS)
def test_no_trick_reaches_this_machine(there: WebhookServer, trick: str) -> None:
    answer = post(trick.format(port=port(there)), SHUT)
    assert answer.outcome == "not_taken"
    assert there.posted == []


@pytest.mark.parametrize(
    "address",
    [
        *("10.0.0.1", "172.16.5.4", "192.168.1.1", "127.8.8.8", "169.254.169.254", "100.64.0.1", "0.1.2.3"),
        *("192.0.0.1", "192.0.0.9", "192.0.0.171", "192.88.99.1", "3fff::1", "2001:1::1", "2001:4:112::1", "100::1"),
        *("224.0.0.1", "240.0.0.1", "255.255.255.255", "168.63.129.16", "192.0.2.1", "198.18.0.1"),
        *("::1", "::", "fe80::1", "fe80::1%eth0", "fc00::1", "fd00:ec2::254", "fec0::1", "ff02::1", "2001:db8::1"),
        *("::ffff:10.0.0.1", "64:ff9b::10.0.0.1", "64:ff9b:1::1", "2002:a00:1::1", "2001:0:1::1", "::10.0.0.1"),
    ],
)
def test_not_public(address: str) -> None:
    assert not may_be_reached(address, SHUT)


@pytest.mark.parametrize("address", ["1.1.1.1", "2606:4700::1111", "::ffff:1.1.1.1", "64:ff9b::1.1.1.1"])
def test_public(address: str) -> None:
    assert may_be_reached(address, SHUT)


@given(inside=st.ip_addresses(v=4))
def test_an_address_in_another_dress_is_judged_as_itself(inside: IPv4Address) -> None:
    for dressed in (f"::ffff:{inside}", str(IPv6Address((0x64FF9B << 96) | int(inside)))):
        assert may_be_reached(dressed, SHUT) == may_be_reached(str(inside), SHUT)


def test_networks_and_names_are_allowed_one_by_one(there: WebhookServer) -> None:
    assert may_be_reached("10.1.2.3", Reach(("10.1.0.0/16",)))
    assert may_be_reached("::ffff:10.1.2.3", Reach(("10.1.0.0/16",)))
    assert not may_be_reached("10.2.2.3", Reach(("10.1.0.0/16",)))
    by_name = Reach(("LOCALHOST",), plain_http=True)
    assert post(there.address, by_name).outcome == "delivered"
    assert post(f"http://127.0.0.1:{port(there)}/", by_name).outcome == "not_taken"


def test_http_only_where_it_is_allowed(there: WebhookServer) -> None:
    answer = post(there.address, replace(OPEN, plain_http=False))
    assert (answer.outcome, "notify.allow_plain_http" in answer.text) == ("not_taken", True)
    assert post("ftp://example.org/").outcome == "not_taken"
    assert post("http://[::1").is_final
    assert there.posted == []


@pytest.mark.parametrize("status", [301, 302, 303, 307, 308])
def test_no_redirect_is_followed(there: WebhookServer, status: int) -> None:
    with webhook_server() as inside:
        there.status, there.headers = status, {"Location": f"{inside.address}/secret"}
        answer = post(there.address)
        assert (answer.outcome, inside.posted) == ("not_taken", [])


def test_the_name_is_resolved_once_and_what_was_checked_is_connected_to(there: WebhookServer) -> None:
    """A name whose address changes a moment later (DNS rebinding) has no effect: it is resolved only once."""
    seen: list[tuple[str, object]] = []
    watching = True

    def watch(event: str, arguments: tuple[object, ...]) -> None:
        if watching and event in ("socket.getaddrinfo", "socket.connect"):
            seen.append((event, arguments[0] if event == "socket.getaddrinfo" else arguments[1]))

    sys.addaudithook(watch)  # stays as long as the process, and then sees nothing any more
    post(there.address)
    watching = False
    assert [name for event, name in seen if event == "socket.getaddrinfo"].count("localhost") == 1
    resolved = {one[4][0] for one in socket.getaddrinfo("localhost", 80)}
    connected = [address[0] for event, address in seen if event == "socket.connect"]  # type: ignore[index]
    assert connected
    assert set(connected) <= resolved


@pytest.mark.parametrize(("status", "outcome"), [(200, "delivered"), (404, "not_taken"), (503, "unknown")])
def test_what_a_status_means(there: WebhookServer, status: int, outcome: str) -> None:
    there.status = status
    assert post(there.address).outcome == outcome


def test_http_410_is_final(there: WebhookServer) -> None:
    there.status = 410
    assert post(there.address).is_final


def test_an_answer_without_end_has_one(there: WebhookServer) -> None:
    there.status, there.answer = 200, b"x" * (MOST_BYTES + 1)
    assert post(there.address).outcome == "unknown"


def test_an_answer_that_drips_has_an_end_in_time(there: WebhookServer) -> None:
    there.status, there.answer, there.drips = 200, b"x" * 100, 0.1
    started = monotonic()
    assert post(there.address, seconds=0.5).outcome == "unknown"
    assert monotonic() - started < 2


def test_a_receiver_that_never_answers_may_have_it(there: WebhookServer) -> None:
    there.meanwhile = lambda: sleep(1)
    assert post(there.address, seconds=0.2).outcome == "unknown"
    given_up = monotonic()
    while not there.posted and monotonic() < given_up + 10:  # a busy machine's server reads it later
        sleep(0.02)
    assert len(there.posted) == 1


def test_where_no_one_listens_nothing_was_taken() -> None:
    with webhook_server() as gone:
        pass
    assert post(gone.address).outcome == "not_taken"
    assert post("https://no-such-host.invalid/").outcome == "not_taken"


def test_over_tls_only_to_whom_a_trusted_certificate_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    authority = trustme.CA()
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    authority.issue_cert("localhost").configure_cert(context)
    with webhook_server(context) as server:
        assert post(server.address).outcome == "not_taken", "nobody trusts it yet"
        authority.cert_pem.write_to_path(str(tmp_path / "ca.pem"))
        monkeypatch.setenv("SSL_CERT_FILE", str(tmp_path / "ca.pem"))
        assert post(server.address).outcome == "delivered"
        assert post(server.address.replace("localhost", "127.0.0.1")).outcome == "not_taken", "it names another"
        assert len(server.posted) == 1
