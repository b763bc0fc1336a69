"""An invalid address of a server is rejected with a message that repeats no secret."""

import pytest

from service.addresses import web_address_problem

SECRETS = ("s3cret", "t0ken", "alice")


@pytest.mark.parametrize(
    ("address", "reason"),
    [
        ("htp:/x", "begins with 'htp:'"),
        ("htp://alice:s3cret@host/x", "begins with 'htp:'"),
        ("host.example/files", "does not begin with http"),
        ("ftp://host.example/files", "begins with 'ftp:'"),
        ("http:///files", "names no host"),
        ("http://", "names no host"),
        ("http://host.example:99999/", "port is not a number"),
        ("http://host.example:s3cret/", "port is not a number"),
        ("http://host.example:0/", "port 0"),
        ("http://[::1/", "host cannot be read"),
        ("http://-host.example/", "not the name of a host"),
        ("http://host..example/", "not the name of a host"),
        ("http://host example/", "not the name of a host"),
        ("http://host.example/a b", "a space"),
    ],
)
def test_what_is_no_web_address_is_refused_by_what_is_wrong_with_it(address: str, reason: str) -> None:
    found = web_address_problem(address)
    assert found is not None
    assert reason in found
    assert "http://host/path and https://host/path are allowed" in found
    assert not any(secret in found for secret in SECRETS)


@pytest.mark.parametrize(
    "address",
    [
        "http://127.0.0.1:8080/fdsnws",
        "https://alice:s3cret@host.example/files/?token=t0ken",
        "http://[::1]:8080/",
        "http://recorder_1/",
        "http://記録.example/",
    ],
)
def test_an_address_at_which_a_server_can_be_requested_is_accepted(address: str) -> None:
    assert web_address_problem(address) is None
