"""Sign-in of people by OpenID Connect, as a client of one provider.

Authorization code with PKCE, state and nonce: OpenID Connect Core 1.0, section 3.1; RFC 7636, 9207 and 9700.
"""

import asyncio
import hashlib
import hmac
import logging
import re
import secrets
import time
from base64 import urlsafe_b64decode, urlsafe_b64encode
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any
from urllib.parse import quote_plus, urlsplit

import httpx
import orjson
from authlib.oauth2.rfc6749.parameters import prepare_grant_uri
from authlib.oauth2.rfc7636 import create_s256_code_challenge
from authlib.oidc.core import CodeIDToken
from authlib.oidc.discovery import get_well_known_url
from joserfc import jwt
from joserfc.errors import JoseError
from joserfc.jwk import KeySet

from service.addresses import is_loopback
from service.settings.groups import Oidc
from service.tls import tls_context

log = logging.getLogger(__name__)

ALGORITHMS = tuple(f"{kind}{bits}" for kind in ("RS", "PS", "ES") for bits in (256, 384, 512))
"""Signatures by the provider's private key; never `none` or a shared secret."""
CLOCKS = 60
"""s by which the provider's clock may differ. Common; not tuned."""
ATTEMPT_LASTS = timedelta(minutes=10)
"""Time in which a person must sign in at the provider. Not tuned."""
WRITTEN = re.compile(r"[\w-]{43}\.(\d{1,12})\.(?:[\w-]{4})*(?:[\w-]{2}==|[\w-]{3}=)?", re.ASCII)
"""Form of the cookie of an attempt."""
KNOWN_LASTS = 600.0
"""s for which the provider's addresses are cached; its keys are read at each sign-in."""
MOST_BYTES = 256 * 1024
"""Largest answer of the provider."""
LONGEST_NAME = 100
"""Characters of a name for the audit trail."""
MOST_GROUPS = 1000
"""Groups of a person that are kept."""


class SignInError(Exception):
    """A sign-in that is refused; the message states the problem and its remedy."""

    status = 401


class ProviderError(SignInError):
    """The provider does not answer, or what it answers is not valid; what is not printable is left out."""

    status = 502

    def __init__(self, problem: str) -> None:
        super().__init__("".join(one for one in problem if one.isprintable()))


@dataclass(frozen=True, slots=True)
class Attempt:
    """A sign-in that a browser has begun: all its secrets are derived from its cookie, so that nothing is stored."""

    cookie: str
    """Random number, time and the page to go on to; each change of it changes the state too."""

    @classmethod
    def new(cls, onward: str, now: datetime) -> "Attempt":
        """An attempt that begins now."""
        return cls(f"{secrets.token_urlsafe(32)}.{int(now.timestamp())}.{urlsafe_b64encode(onward.encode()).decode()}")

    @property
    def state(self) -> str:
        """The value that the provider repeats, which proves that this browser began the sign-in."""
        return self._derived("state")

    @property
    def nonce(self) -> str:
        """The value that the provider signs."""
        return self._derived("nonce")

    @property
    def verifier(self) -> str:
        """The secret of PKCE."""
        return self._derived("verifier")

    @property
    def onward(self) -> str:
        """The page to go on to."""
        return urlsafe_b64decode(self.cookie.split(".")[2]).decode("utf-8", "replace")

    def is_answered_by(self, state: str, now: datetime) -> bool:
        """True if a state is that of this attempt, which began less than ATTEMPT_LASTS ago."""
        form = WRITTEN.fullmatch(self.cookie)  # a state can be computed for any other text too, such as an empty one
        if form is None or not hmac.compare_digest(self.state.encode(), state.encode()):
            return False
        return 0 <= now.timestamp() - int(form[1]) <= ATTEMPT_LASTS.total_seconds()

    def _derived(self, purpose: str) -> str:
        derived = hmac.digest(self.cookie.encode(), purpose.encode(), hashlib.sha256)
        return urlsafe_b64encode(derived).rstrip(b"=").decode()


@dataclass(frozen=True, slots=True)
class Person:
    """A person whom the provider has identified."""

    name: str
    """For pages and the audit trail."""
    subject: str
    """Number at the provider, which never changes."""
    groups: tuple[str, ...]


class Provider:
    """The sign-in provider of the settings."""

    def __init__(
        self,
        settings: Oidc,
        public_url: str,
        clock: Callable[[], float] = time.monotonic,
        now: Callable[[], float] = time.time,
    ) -> None:
        assert settings.issuer is not None
        assert settings.client_id is not None
        self.settings, self._clock, self._now = settings, clock, now
        self.issuer, self._client_id = settings.issuer, settings.client_id
        self._redirect = f"{public_url.rstrip('/')}/login/callback"
        self._tls = tls_context()
        self._known: dict[str, Any] = {}
        self._known_at = -float("inf")
        self._is_failing = False

    async def address(self, attempt: Attempt) -> str:
        """Address at the provider to which the browser goes.

        Raises:
            ProviderError: the provider does not answer, or its answer is invalid.
        """
        known = await self._limited(self._metadata)
        address: str = prepare_grant_uri(
            known["authorization_endpoint"],
            self._client_id,
            "code",
            self._redirect,
            " ".join(self.settings.scopes),
            attempt.state,
            nonce=attempt.nonce,
            code_challenge=create_s256_code_challenge(attempt.verifier),
            code_challenge_method="S256",
        )
        return address

    async def person(self, attempt: Attempt, code: str, issuer: str | None) -> Person:
        """The person who has signed in.

        Args:
            attempt: whose state the provider has repeated.
            code: that the provider gave the browser.
            issuer: that the provider named in the same answer (RFC 9207), which reveals a mix-up of providers.

        Raises:
            ProviderError: the provider does not answer, or what it answers is not valid.
        """

        async def identified(client: httpx.AsyncClient) -> CodeIDToken:
            known = await self._metadata(client)
            is_named = issuer is not None or known.get("authorization_response_iss_parameter_supported") is True
            if is_named and issuer != self.issuer:
                raise ProviderError(f"The answer came from another provider ({str(issuer)[:200]}) than {self.issuer}.")
            tokens = await self._tokens(client, known, attempt, code)
            keys = await self._json(client, "GET", known["jwks_uri"])
            return self._verified(tokens, keys, attempt)

        return self._described(await self._limited(identified))

    async def _limited(self, ask: Callable[[httpx.AsyncClient], Any]) -> Any:  # noqa: ANN401
        """The result of an exchange with the provider, limited in time; a line is logged when it fails and recovers."""
        seconds = self.settings.timeout
        try:
            async with asyncio.timeout(seconds), httpx.AsyncClient(verify=self._tls, timeout=seconds) as client:
                result = await ask(client)
        except (httpx.HTTPError, httpx.InvalidURL, TimeoutError) as error:
            raise self._failed(
                ProviderError(f"The provider {self.issuer} does not answer ({type(error).__name__}); try again soon.")
            ) from error
        except ProviderError as error:
            raise self._failed(error) from error
        if self._is_failing:
            log.info("the sign-in provider works again")
        self._is_failing = False
        return result

    def _failed(self, error: ProviderError) -> ProviderError:
        if not self._is_failing:
            log.warning("a sign-in failed: %s", error)
        self._is_failing = True
        return error

    async def _metadata(self, client: httpx.AsyncClient) -> dict[str, Any]:
        """The provider's addresses (OpenID Connect Discovery 1.0, section 4)."""
        if self._clock() - self._known_at > KNOWN_LASTS:
            known = await self._json(client, "GET", get_well_known_url(self.issuer, external=True))
            if known.get("issuer") != self.issuer:
                raise ProviderError(
                    f"The provider calls itself {str(known.get('issuer'))[:200]!r}, the settings {self.issuer!r}: "
                    "oidc.issuer must be the same, to the last character."
                )
            for name in ("authorization_endpoint", "token_endpoint", "jwks_uri"):
                self._check_address(name, known.get(name))
            self._known, self._known_at = known, self._clock()
        return self._known

    def _check_address(self, name: str, address: object) -> None:
        """Refuse an address that would carry secrets without encryption."""
        parts = urlsplit(address if isinstance(address, str) else "")
        is_local = urlsplit(self.issuer).scheme == "http" and parts.scheme == "http" and is_loopback(parts.hostname)
        if not parts.hostname or not (parts.scheme == "https" or is_local):
            raise ProviderError(f"The provider's {name} is not an address with https://.")

    async def _tokens(
        self, client: httpx.AsyncClient, known: Mapping[str, Any], attempt: Attempt, code: str
    ) -> dict[str, Any]:
        """The provider's tokens for a code (RFC 6749, section 4.1.3)."""
        sent = {
            "grant_type": "authorization_code",
            "code": code,
            "redirect_uri": self._redirect,
            "code_verifier": attempt.verifier,
        }
        ways = known.get("token_endpoint_auth_methods_supported") or ["client_secret_basic"]
        secret = self.settings.client_secret
        if secret is not None and "client_secret_basic" in ways:
            auth = httpx.BasicAuth(quote_plus(self._client_id), quote_plus(secret.get_secret_value()))
            return await self._json(client, "POST", known["token_endpoint"], data=sent, auth=auth)
        sent["client_id"] = self._client_id
        if secret is not None:
            sent["client_secret"] = secret.get_secret_value()
        return await self._json(client, "POST", known["token_endpoint"], data=sent)

    async def _json(self, client: httpx.AsyncClient, method: str, address: str, **how: Any) -> dict[str, Any]:  # noqa: ANN401
        """A JSON object; redirects are not followed, and a long answer is not read."""
        body = bytearray()
        async with client.stream(method, address, headers={"Accept": "application/json"}, **how) as response:
            async for part in response.aiter_bytes():
                body += part
                if len(body) > MOST_BYTES:
                    raise ProviderError(f"An answer of the provider is longer than {MOST_BYTES} bytes.")
        try:
            answer = orjson.loads(bytes(body))
        except orjson.JSONDecodeError:
            answer = None
        if response.status_code != 200:
            code = answer.get("error") if isinstance(answer, dict) else None
            raise ProviderError(
                f"The provider answers {urlsplit(address).path} with {response.status_code}"
                f"{f' ({shown_code(code)})' if code else ''}."
            )
        if not isinstance(answer, dict):
            raise ProviderError(f"The provider's answer at {urlsplit(address).path} is not a JSON object.")
        return answer

    def _verified(self, tokens: Mapping[str, Any], keys: Mapping[str, Any], attempt: Attempt) -> CodeIDToken:
        """The claims of the ID token, after all checks of OpenID Connect Core 1.0, section 3.1.3.7."""
        expected = {
            "iss": {"essential": True, "value": self.issuer},
            "aud": {"essential": True, "value": self._client_id},
        }
        about = {"nonce": attempt.nonce, "client_id": self._client_id, "access_token": tokens.get("access_token")}
        try:
            token = jwt.decode(tokens["id_token"], KeySet.import_key_set(keys), algorithms=ALGORITHMS)  # type: ignore[arg-type]
            claims = CodeIDToken(token.claims, token.header, expected, about)
            claims.validate(int(self._now()), CLOCKS)
        except (JoseError, ValueError, TypeError, KeyError, AttributeError) as error:
            raise ProviderError(
                f"The provider's ID token is not valid: {str(error)[:200] or type(error).__name__}."
            ) from error
        return claims

    def _described(self, claims: Mapping[str, Any]) -> Person:
        """The person whom the claims describe."""
        subject = claims["sub"].strip()
        if not subject:
            raise ProviderError("The provider's ID token names no person (sub is empty).")
        name = claims.get(self.settings.name_claim)
        if not isinstance(name, str) or not name.strip() or not name.isprintable() or len(name) > LONGEST_NAME:
            name = subject
        groups = _claim(claims, self.settings.groups_claim)
        listed = [groups] if isinstance(groups, str) else groups if isinstance(groups, list) else []
        kept = dict.fromkeys(one for one in listed if isinstance(one, str))
        return Person(f"person:{name.strip()[:LONGEST_NAME]}", subject, tuple(kept)[:MOST_GROUPS])


def _claim(claims: Mapping[str, Any], path: str) -> object:
    """A claim by its name, or by a path of names with dots."""
    if path in claims:
        return claims[path]
    found: object = claims
    for name in path.split("."):
        found = found.get(name) if isinstance(found, Mapping) else None
    return found


def shown_code(code: object) -> str:
    """An error code of the provider (RFC 6749, section 4.1.2.1), if it looks like one."""
    is_code = isinstance(code, str) and len(code) <= 50 and code.replace("_", "").isalnum() and code.isascii()
    return str(code) if is_code else "an error without a valid code"
