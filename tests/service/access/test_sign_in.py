"""Sign-in of people by a provider: an honest one, and every way in which one can lie or a stranger can interfere."""

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import databases
import paper_records
import pytest
from accessible import problems
from api_client import TestClient, client
from api_server import LOCALHOST, api_server
from browsers import needs_chromium
from joserfc.jwk import ECKey
from sign_in_providers import CLIENT, LyingProvider, lying_provider, real_provider, signed_in_at
from sqlalchemy import select, update
from sqlalchemy.orm import Session, sessionmaker
from system_chromium import chromium

from service.access import keys, logins
from service.access.auth import COOKIE, SAFE_COOKIE
from service.access.pages.sign_in import BEGUN, SAFE_BEGUN
from service.access.provider import Attempt
from service.access.tables import AuditEntry, LoginSession
from service.buildings import store as building_store
from service.settings import Settings

pytestmark = pytest.mark.sqlite

GRANTS = (
    {"group": "engineers", "role": "engineer"},
    {"group": "guests", "role": "viewer", "buildings": ("OTHER",)},
    {"group": "keepers", "role": "admin", "buildings": ("PAPER",)},
    {"group": "guests", "role": "viewer", "buildings": ("PAPER",)},
)
PUBLIC = "http://127.0.0.1:8000"
HANA = {"sub": "17", "preferred_username": "hana", "groups": ["engineers"]}
GUEST = {"sub": "18", "preferred_username": "guest", "realm": {"groups": "guests"}, "groups": []}
STRANGER = {"sub": "19", "preferred_username": "stranger", "groups": ["cooks"]}
Opened = Callable[..., AbstractContextManager[TestClient]]


@pytest.fixture(autouse=True)
def unthrottled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every line of the log: a server that ran in this process before limits them."""
    monkeypatch.setattr(logging.getLogger("service.access.provider"), "filters", [])


@pytest.fixture(scope="module")
def issuer() -> Iterator[str]:
    with real_provider(HANA, GUEST, STRANGER) as started:
        yield started


@pytest.fixture
def lying() -> Iterator[LyingProvider]:
    with lying_provider() as started:
        yield started


@pytest.fixture
def opened(database_url: str) -> Opened:
    """A browser at a service with this provider."""

    @contextmanager
    def browser(issuer: str, public: str = PUBLIC, scheme: str = "http", **oidc: object) -> Iterator[TestClient]:
        settings = {"issuer": issuer, "client_id": CLIENT, "client_secret": "hush", "grants": GRANTS} | oidc
        with client(database_url, visitor=None, scheme=scheme, public_url=public, oidc=settings) as made:
            yield made

    return browser


def begun(browser: TestClient, onward: str = "/") -> str:
    """Address at the provider of a sign-in that the browser begins."""
    answer = browser.get("/login/provider", params={"next": onward})
    assert answer.status_code == 303, answer.text
    return answer.headers["location"]


def come_back(browser: TestClient, address: str) -> int:
    return browser.get(address.removeprefix(PUBLIC)).status_code


def test_a_person_signs_in_reads_and_signs_out(opened: Opened, issuer: str, sessions: sessionmaker[Session]) -> None:
    with opened(issuer) as browser:
        assert (
            'href="/login/provider?next=%2Fdocs">Sign in with single sign-on' in browser.get("/login?next=/docs").text
        )
        address = begun(browser, "/docs")
        asked = {name: one[0] for name, one in parse_qs(urlsplit(address).query).items()}
        assert asked["redirect_uri"] == f"{PUBLIC}/login/callback"
        assert (asked["response_type"], asked["code_challenge_method"]) == ("code", "S256")
        answer = browser.get(signed_in_at(address, "17").removeprefix(PUBLIC))
        assert answer.status_code == 200
        assert '<meta http-equiv="refresh" content="0; url=/docs">' in answer.text
        assert "signed in as hana" in answer.text
        assert (answer.headers["referrer-policy"], answer.headers["cache-control"]) == ("no-referrer", "no-store")
        assert BEGUN not in browser.cookies
        stolen = browser.cookies[COOKIE]
        assert browser.get("/").status_code == 200
        assert browser.get("/api/v1/audit").status_code == 200, "an engineer"
        assert browser.post("/api/v1/buildings/X/receivers", json={}).status_code == 403, "but no admin"
        assert browser.post("/logout").status_code == 303
        browser.cookies.set(COOKIE, stolen)
        assert browser.get("/").status_code == 303
    with sessions() as session:
        trail = [(one.by, one.action, one.target, one.details) for one in session.scalars(select(AuditEntry))]
    said = {"session": "begun", "subject": "17", "groups": ["engineers"]}
    assert trail == [
        ("person:hana", "GET", "/login/callback", said),
        ("person:hana", "POST", "/logout", {"session": "ended"}),
    ]


@pytest.mark.slow
@needs_chromium
def test_a_browser_signs_in_without_javascript(database_url: str, issuer: str) -> None:
    """Chromium decides which cookies come back with a person whom another site, the provider's, sends."""
    oidc = {"issuer": issuer, "client_id": CLIENT, "client_secret": "hush", "grants": GRANTS}
    with (
        api_server(database_url, visitor=None, public_url=LOCALHOST, oidc=oidc) as own,
        chromium() as browser,
    ):
        address = own.replace("127.0.0.1", "localhost")
        page = browser.new_context(java_script_enabled=False).new_page()
        page.goto(f"{address}/effects")
        page.get_by_role("link", name="Sign in with single sign-on").click()
        page.get_by_role("button", name="17").click()
        page.wait_for_url(f"{address}/effects")
        (cookie,) = page.context.cookies()
        assert (cookie["name"], cookie["httpOnly"], cookie["sameSite"]) == (COOKIE, True, "Strict")
        page.get_by_role("button", name="Log out").click()
        page.wait_for_url(f"{address}/login")
        looked_at = browser.new_page()
        looked_at.goto(f"{address}/login/callback")
        assert "not begun in this browser" in looked_at.text_content("main")
        assert problems(looked_at) == []


def test_a_session_is_limited_to_the_buildings_of_its_groups(
    opened: Opened, issuer: str, sessions: sessionmaker[Session], tmp_path: Path
) -> None:
    text = paper_records.building_file()
    with sessions.begin() as session:
        for code in ("PAPER", "OTHER", "THIRD"):
            building_store.add(session, text.replace("PAPER", code), tmp_path, datetime.now(UTC))
    with opened(issuer, groups_claim="realm.groups") as browser:
        assert come_back(browser, signed_in_at(begun(browser), "18")) == 200
        shown = [one["code"] for one in browser.get("/api/v1/buildings").json()["items"]]
        assert shown == ["OTHER", "PAPER"]
        assert browser.get("/api/v1/buildings/THIRD").status_code == 404


def test_a_person_without_a_granted_group_learns_what_helps(
    opened: Opened, issuer: str, sessions: sessionmaker[Session]
) -> None:
    with opened(issuer) as browser:
        answer = browser.get(signed_in_at(begun(browser), "19").removeprefix(PUBLIC))
        assert answer.status_code == 403
        assert "Their groups: cooks." in answer.text
        assert "oidc.grants" in answer.text
        assert COOKIE not in browser.cookies
        absent = browser.get(signed_in_at(begun(browser), "18").removeprefix(PUBLIC))
        assert "none (the claim &#39;groups&#39; is absent or empty)" in absent.text
    with sessions() as session:
        assert [one.details["subject"] for one in session.scalars(select(AuditEntry))] == ["19", "18"]


def test_over_https_both_cookies_are_safe_and_each_sign_in_has_a_new_one(opened: Opened, lying: LyingProvider) -> None:
    with opened(lying.issuer, "https://127.0.0.1:8000", "https") as browser:
        answer = browser.get("/login/provider")
        attempt = answer.headers["set-cookie"]
        assert attempt.startswith(f"{SAFE_BEGUN}=")
        assert {"HttpOnly", "Secure", "SameSite=lax", "Path=/"} <= set(attempt.split("; "))
        browser.cookies.set(SAFE_COOKIE, "planted", domain="127.0.0.1", path="/")
        made = browser.get(lying.sign_in(answer.headers["location"])).headers.get_list("set-cookie")
        session = next(one for one in made if one.startswith(f"{SAFE_COOKIE}="))
        assert {"HttpOnly", "Secure", "SameSite=strict", "Path=/"} <= set(session.split("; "))
        assert "planted" not in session


def test_a_new_sign_in_ends_the_browsers_earlier_session(
    opened: Opened, lying: LyingProvider, sessions: sessionmaker[Session]
) -> None:
    with opened(lying.issuer) as browser:
        for _ in range(2):
            assert come_back(browser, lying.sign_in(begun(browser))) == 200
    with sessions() as session:
        first, second = session.scalars(select(LoginSession).order_by(LoginSession.id))
        assert (first.ended_at is None, second.ended_at is None) == (False, True)
        assert first.hash != second.hash


LIES: dict[str, Callable[[LyingProvider], None]] = {
    "its signature is by another key": lambda it: setattr(it, "published", ECKey.generate_key("P-256", {"kid": "one"})),
    "its key is unknown": lambda it: setattr(it, "published", ECKey.generate_key("P-256", {"kid": "two"})),
    "it is not signed": lambda it: it.header.update(alg="none"),
    "the public key is used as a shared secret": lambda it: it.header.update(alg="HS256", kid="one"),
    "it is by another issuer": lambda it: it.claims.update(iss="http://127.0.0.1:1"),
    "it is for another client": lambda it: it.claims.update(aud="other"),
    "it is for several, and not for us first": lambda it: it.claims.update(aud=[CLIENT, "other"], azp="other"),
    "it has no audience": lambda it: it.claims.update(aud=None),
    "it has ended": lambda it: it.claims.update(exp=int(time.time()) - 120),
    "it has no end": lambda it: it.claims.update(exp=None),
    "it comes from the future": lambda it: it.claims.update(iat=int(time.time()) + 600),
    "it is of another sign-in": lambda it: it.claims.update(nonce="other"),
    "it has no nonce": lambda it: it.claims.update(nonce=None),
    "it is for another access token": lambda it: it.claims.update(at_hash="AAAAAAAAAAAAAAAAAAAAAA"),
    "it names no one": lambda it: it.claims.update(sub=""),
    "it is no token": lambda it: setattr(it, "token", "x"),
    "there is none": lambda it: setattr(it, "_token", lambda _: (200, {"access_token": "a"})),
    "the answer is no JSON": lambda it: setattr(it, "_token", lambda _: (200, b"<html>")),
    "the answer is a list": lambda it: setattr(it, "_token", lambda _: (200, [])),
    "the answer has no end": lambda it: setattr(it, "_token", lambda _: (200, b" " * 300_000)),
    "the provider is broken": lambda it: setattr(it, "_token", lambda _: (500, {})),
}


@pytest.fixture(scope="module")
def before_lies(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[LyingProvider, TestClient]]:
    """A provider and a browser at a service: one for all lies, because a service takes long to make."""
    url = databases.sqlite(tmp_path_factory.mktemp("lies"))
    with lying_provider() as provider:
        oidc = {"issuer": provider.issuer, "client_id": CLIENT, "grants": GRANTS}
        with client(url, visitor=None, public_url=PUBLIC, oidc=oidc) as browser:
            yield provider, browser


@pytest.mark.parametrize("lie", [None, *LIES])
def test_a_provider_that_lies_signs_no_one_in(before_lies: tuple[LyingProvider, TestClient], lie: str | None) -> None:
    lying, browser = before_lies
    vars(lying).clear()
    vars(lying).update(vars(LyingProvider(lying_issuer(browser))))
    browser.app.state.attempts = logins.Attempts()
    browser.cookies.clear()
    address = begun(browser)
    if lie is not None:
        LIES[lie](lying)
    answer = browser.get(lying.sign_in(address))
    if lie is None:
        assert (answer.status_code, COOKIE in browser.cookies) == (200, True), "otherwise no lie would prove anything"
        return
    assert answer.status_code == 502
    assert "Not accepted.</b> The provider" in answer.text or "An answer of the provider" in answer.text
    assert COOKIE not in browser.cookies
    assert browser.get("/").status_code == 303


def lying_issuer(browser: TestClient) -> str:
    """Address of the provider in the settings of the browser's service."""
    issuer: str = browser.app.state.settings.oidc.issuer
    return issuer


@pytest.mark.parametrize("clock", [-50, 50])
def test_clocks_may_differ_by_a_minute(opened: Opened, lying: LyingProvider, clock: int) -> None:
    with opened(lying.issuer) as browser:
        now = int(time.time()) + clock
        lying.claims.update(iat=now, exp=now + 30)
        assert come_back(browser, lying.sign_in(begun(browser))) == 200


def test_a_provider_that_lies_about_itself_is_not_used(opened: Opened, lying: LyingProvider) -> None:
    with opened(lying.issuer) as browser:
        for metadata, problem in (
            ({"issuer": "http://127.0.0.1:1"}, "calls itself"),
            ({"issuer": None}, "calls itself"),
            ({"token_endpoint": "http://provider.example/token"}, "token_endpoint is not an address with https"),
            ({"authorization_endpoint": "javascript:alert(1)"}, "authorization_endpoint is not an address with https"),
            ({"jwks_uri": ["x"]}, "jwks_uri is not an address with https"),
        ):
            lying.metadata = metadata
            answer = browser.get("/login/provider")
            assert (answer.status_code, problem in answer.text) == (502, True), problem
        lying.metadata = {}
        assert browser.get("/login/provider").status_code == 303


def test_a_provider_that_is_down_or_slow_is_reported_in_time(
    opened: Opened, lying: LyingProvider, caplog: pytest.LogCaptureFixture
) -> None:
    with opened("http://127.0.0.1:1") as browser:
        down = browser.get("/login/provider")
    caplog.set_level("INFO", "service.access.provider")
    lying.delay = 30.0
    with opened(lying.issuer, timeout=0.2) as browser:
        begun_at = time.monotonic()
        slow = [browser.get("/login/provider") for _ in range(2)]
        assert time.monotonic() - begun_at < lying.delay / 2
        lying.delay = 0.0
        assert browser.get("/login/provider").status_code == 303
        assert browser.get("/login").status_code == 200, "keys still work"
    for answer in (down, *slow):
        assert answer.status_code == 502
        assert "does not answer" in answer.text
    said = [one.message for one in caplog.records if one.name == "service.access.provider"]
    assert [line.partition(":")[0] for line in said] == ["a sign-in failed"] * 2 + ["the sign-in provider works again"]


def test_a_state_counts_once_and_in_the_browser_that_began(opened: Opened, lying: LyingProvider) -> None:
    with opened(lying.issuer) as browser:
        address = begun(browser)
        attempt, back = browser.cookies[BEGUN], lying.sign_in(address)
        browser.cookies.clear()
        assert come_back(browser, back) == 400, "another browser has no cookie of the attempt"
        browser.cookies.set(BEGUN, attempt)
        assert come_back(browser, back) == 200
        browser.cookies.clear()
        browser.cookies.set(BEGUN, attempt)
        assert come_back(browser, lying.sign_in(address)) == 400, "replayed, with a new code"
        assert COOKIE not in browser.cookies
        browser.cookies.clear()
        begun(browser)
        assert come_back(browser, back) == 400, "the state of another attempt"
        assert browser.get("/login/callback").status_code == 400
        assert browser.get("/login/callback", params={"state": "é"}).status_code == 400


def test_a_state_that_anyone_can_compute_does_not_count(opened: Opened, lying: LyingProvider) -> None:
    """Else a stranger would make one for a browser that has begun nothing, and sign it in as themselves."""
    with opened(lying.issuer) as browser:
        for cookie in ("", ".", "x.y.z", "..", f"{'a' * 43}.1.", f"{'a' * 43}.x.Lw=="):
            browser.cookies.set(BEGUN, cookie)
            assert come_back(browser, f"/login/callback?state={Attempt(cookie).state}&code=x") == 400
            browser.cookies.clear()


def test_an_attempt_that_was_changed_or_is_old_does_not_count(opened: Opened, lying: LyingProvider) -> None:
    with opened(lying.issuer) as browser:
        back = lying.sign_in(begun(browser))
        number, at, page = browser.cookies[BEGUN].split(".")
        for changed in (f"{number}.{at}.Ly9ldmlsLmV4YW1wbGU=", f"{number}.{int(at) + 60}.{page}"):
            browser.cookies.clear()
            browser.cookies.set(BEGUN, changed)
            assert come_back(browser, back) == 400
        old = Attempt(f"{number}.{int(at) - 700}.{page}")
        browser.cookies.clear()
        browser.cookies.set(BEGUN, old.cookie)
        assert come_back(browser, f"/login/callback?state={old.state}&code=x") == 400


def test_an_answer_of_another_provider_is_refused(
    opened: Opened, lying: LyingProvider, caplog: pytest.LogCaptureFixture
) -> None:
    """RFC 9207: the provider names itself, which reveals a mix-up."""
    with opened(lying.issuer) as browser:
        back = lying.sign_in(begun(browser))
        answer = browser.get(f"{back}&iss=http://127.0.0.1:1%0aforged")
        assert answer.status_code == 502
        assert "another provider" in answer.text
        assert caplog.messages[-1].splitlines() == [caplog.messages[-1]], "no forged line in the log"
        assert come_back(browser, f"{lying.sign_in(begun(browser))}&iss={lying.issuer}") == 200
    lying.metadata["authorization_response_iss_parameter_supported"] = True
    with opened(lying.issuer) as browser:
        assert come_back(browser, lying.sign_in(begun(browser))) == 502, "it promised to name itself"


def test_a_refusal_of_the_provider_is_shown_without_its_words(opened: Opened, lying: LyingProvider) -> None:
    with opened(lying.issuer) as browser:
        for error, shown in (("access_denied", "access_denied"), ("<b>call 555", "an error without a valid code")):
            state = parse_qs(urlsplit(begun(browser)).query)["state"][0]
            said = {"state": state, "error": error, "error_description": "evil"}
            answer = browser.get("/login/callback", params=said)
            assert answer.status_code == 403
            assert shown in answer.text
            assert "evil" not in answer.text
            assert "555" not in answer.text


def test_no_one_is_sent_to_another_site(opened: Opened, lying: LyingProvider) -> None:
    with opened(lying.issuer) as browser:
        for onward in ("http://evil.example/", "//evil.example", "/\\evil.example", '/"><script>', "/\tx", ""):
            answer = browser.get(lying.sign_in(begun(browser, onward)))
            assert 'content="0; url=/">' in answer.text
            assert "evil" not in answer.text
            assert "<script>" not in answer.text


def test_too_many_refused_sign_ins_make_an_address_wait(opened: Opened, lying: LyingProvider) -> None:
    with opened(lying.issuer) as browser:
        statuses = [come_back(browser, "/login/callback?state=x&code=y") for _ in range(logins.ATTEMPTS + 1)]
        assert statuses == [400] * logins.ATTEMPTS + [429]
        assert browser.get("/login/provider").status_code == 429


def test_a_session_ends_with_its_time_its_group_and_its_provider(
    opened: Opened, lying: LyingProvider, sessions: sessionmaker[Session]
) -> None:
    with opened(lying.issuer, session_lifetime=3600.0) as browser:
        assert come_back(browser, lying.sign_in(begun(browser))) == 200
        cookie = browser.cookies[COOKIE]
        assert browser.get("/").status_code == 200
        assert "Your access ends" not in browser.get("/").text, "signing in again is all it takes"
    for other in ({"grants": GRANTS[1:]}, {"issuer": "http://127.0.0.1:1"}):
        with opened(**({"issuer": lying.issuer} | other)) as browser:
            browser.cookies.set(COOKIE, cookie)
            assert browser.get("/").status_code == 303, other
    with sessions.begin() as session:
        assert session.scalars(select(LoginSession)).one().expires_at > datetime.now(UTC) + timedelta(minutes=59)
        session.execute(update(LoginSession).values(expires_at=datetime.now(UTC)))
    with opened(lying.issuer) as browser:
        browser.cookies.set(COOKIE, cookie)
        assert browser.get("/").status_code == 303


def test_an_operator_logs_a_person_out(opened: Opened, lying: LyingProvider, sessions: sessionmaker[Session]) -> None:
    with opened(lying.issuer) as browser:
        assert come_back(browser, lying.sign_in(begun(browser))) == 200
        with sessions.begin() as session:
            ended = [keys.log_out(session, f"person:{name}", datetime.now(UTC)) for name in ("other", "hana", "hana")]
        assert ended == [0, 1, 0]
        browser.app.state.callers.forget()
        assert browser.get("/").status_code == 303


def test_a_name_that_could_deceive_is_replaced_by_the_subject(opened: Opened, lying: LyingProvider) -> None:
    with opened(lying.issuer) as browser:
        for name in ("a\u202eb", "x" * 200, " ", 7, None):
            lying.claims.update(preferred_username=name, sub="number-1")
            assert "signed in as number-1" in browser.get(lying.sign_in(begun(browser))).text


def test_without_a_provider_there_is_no_sign_in(database_url: str) -> None:
    with client(database_url, visitor=None) as browser:
        assert "Sign in" not in browser.get("/login").text
        assert browser.get("/login/provider").status_code == 404
        assert browser.get("/login/callback").status_code == 404


@pytest.mark.parametrize(
    ("changed", "problem"),
    [
        ({"issuer": "http://provider.example"}, "must begin with https://"),
        ({"issuer": "https://user@provider.example"}, "without query, fragment and user name"),
        ({"client_id": None}, "oidc.issuer and oidc.client_id go together"),
        ({"grants": ()}, "oidc.grants is empty"),
        ({"scopes": ("profile",)}, "openid"),
        ({"grants": ({"group": "g", "role": "king"},)}, "viewer"),
    ],
)
def test_settings_that_would_be_unsafe_are_refused(changed: dict[str, object], problem: str) -> None:
    oidc = {"issuer": "https://provider.example", "client_id": CLIENT, "grants": GRANTS} | changed
    with pytest.raises(ValueError, match=problem):
        Settings(public_url="https://menshin.example", oidc=oidc)


def test_a_sign_in_needs_a_public_address() -> None:
    oidc = {"issuer": "https://provider.example", "client_id": CLIENT, "grants": GRANTS}
    for public in (None, "http://menshin.example"):
        with pytest.raises(ValueError, match=r"oidc\.issuer needs public_url"):
            Settings(public_url=public, oidc=oidc)
