"""Requests to a server, with repetitions and limits: available data is fetched, missing data is reported."""

import gc
import os
import ssl
import tracemalloc
from pathlib import Path
from shutil import copyfile

import pytest
from monitoring_server import Page, Server, monitoring_server

from service.records.sources.retried_requests import Client, client
from service.records.sources.source import SourceError, TooLargeError


def test_an_error_that_passes_is_tried_again(server: Server, api: Client) -> None:
    server.pages["/a"] = Page(b"data", failures=2)
    assert api.get(f"{server.address}/a").body == b"data"


def test_an_error_that_stays_is_reported(server: Server, api: Client) -> None:
    server.pages["/a"] = Page(b"data", failures=99)
    with pytest.raises(SourceError, match=r"/a answered 500 .*, 3 times"):
        api.get(f"{server.address}/a")


def test_a_refusal_is_not_repeated(server: Server, api: Client) -> None:
    server.pages["/a"] = Page(status=403)
    with pytest.raises(SourceError, match="answered 403 Forbidden"):
        api.get(f"{server.address}/a")
    assert len(server.requested) == 1


def test_a_stalled_body_is_given_up(server: Server, api: Client) -> None:
    server.pages["/a"] = Page(b"x" * 1000, stalls=True)
    with pytest.raises(SourceError, match=r"did not answer within 0\.5 s, 3 times"):
        api.get(f"{server.address}/a")


def test_a_server_that_is_away_is_reported(api: Client) -> None:
    with pytest.raises(SourceError, match="cannot be reached"):
        api.get("http://127.0.0.1:1/a")


def test_an_interrupted_response_is_resumed(server: Server, api: Client) -> None:
    body = bytes(range(256)) * 100
    server.add("/a", body).breaks_after = 10_000
    assert api.get(f"{server.address}/a").body == body
    assert server.requested[1][1]["Range"] == "bytes=10000-"


def test_two_gigabytes_are_refused_by_their_promise(server: Server, api: Client) -> None:
    server.pages["/a"] = Page(b"x" * 1000, promised=2 * 10**9)
    tracemalloc.start()
    with pytest.raises(TooLargeError, match="has 2000000000 bytes, 1000000 are accepted"):
        api.get(f"{server.address}/a")
    assert tracemalloc.get_traced_memory()[1] < 5_000_000
    tracemalloc.stop()


@pytest.mark.parametrize("status", [301, 302, 303, 307, 308])
def test_a_redirect_to_another_server_is_refused(server: Server, api: Client, status: int) -> None:
    with monitoring_server() as inside:
        inside.pages["/secrets"] = Page(b"of the inside")
        server.pages["/a"] = Page(status=status, headers={"Location": f"{inside.address}/secrets?token=x"})
        with pytest.raises(SourceError, match=r"/a redirects to another server, http://127[0-9.:]+/secrets, which"):
            api.get(f"{server.address}/a")
        assert inside.requested == []


def test_a_redirect_to_another_scheme_is_refused(server: Server, api: Client) -> None:
    server.pages["/a"] = Page(status=302, headers={"Location": server.address.replace("http:", "https:") + "/b"})
    with pytest.raises(SourceError, match="redirects to another server, https:"):
        api.get(f"{server.address}/a")


def test_a_redirect_within_the_server_is_followed(server: Server, api: Client) -> None:
    server.pages["/a"] = Page(status=302, headers={"Location": "/b"})
    server.pages["/b"] = Page(b"moved")
    assert api.get(f"{server.address}/a").body == b"moved"


def test_redirects_without_an_end_are_given_up(server: Server, api: Client) -> None:
    server.pages["/a"] = Page(status=302, headers={"Location": "/a"})
    with pytest.raises(SourceError, match="redirects more than 5 times"):
        api.get(f"{server.address}/a")


def test_a_time_to_wait_that_is_no_number_is_passed_over(server: Server, api: Client) -> None:
    server.pages["/a"] = Page(status=503, headers={"Retry-After": "²"})
    with pytest.raises(SourceError, match="answered 503"):
        api.get(f"{server.address}/a")


def test_an_address_that_is_none_is_reported(api: Client) -> None:
    with pytest.raises(SourceError, match="is not a valid address"):
        api.get("http://127.0.0.1:port/a")


def test_the_looks_of_a_process_share_one_tls_context(
    api: Client, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def contexts() -> int:
        return sum(issubclass(type(one), ssl.SSLContext) for one in gc.get_objects())

    # certificates of its own: an older context may be frozen by `gc.freeze`, and is not counted then
    monkeypatch.setenv("SSL_CERT_FILE", str(copyfile(os.environ["SSL_CERT_FILE"], tmp_path / "trusted.pem")))
    gc.collect()
    made = [client(api.settings, api.manners)]
    before = contexts()
    made += [client(api.settings, api.manners) for _ in range(3)]
    assert contexts() == before > 0
    for one in made:
        one.http.close()
