"""Sign-in of people by the provider of the settings: to the provider, back, and on to the page that was wanted."""

from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Annotated, Literal, TypedDict

from anyio import to_thread
from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.exc import IntegrityError
from starlette.responses import RedirectResponse

from service.access import logins
from service.access.auth import is_secure
from service.access.callers import person_caller
from service.access.pages import address_of, keep, login_form, must_wait, note_session, onward
from service.errors import NotFoundError
from service.http.forms import Refused
from service.http.rendering import SECRETIVE, page
from service.settings import Settings

if TYPE_CHECKING:
    from service.access.provider import Attempt, Person, Provider

BEGUN, SAFE_BEGUN = "menshin-sign-in", "__Host-menshin-sign-in"
"""Names of the cookie of a sign-in that has begun, for plain http on loopback and for https."""
LONGEST = 4096
"""Characters of a parameter of the provider's answer."""
NOT_BEGUN = (
    "This sign-in was not begun in this browser, was begun again in another tab, or took more than ten minutes. "
    "Please sign in again."
)
USED = "This sign-in was completed before. Please sign in again."
NO_ROLE = (
    "{name} is signed in at the provider, but none of their groups has a role here. Their groups: {groups}. Ask an "
    "administrator of Menshin to give one of them a role (oidc.grants), or one of the provider to add you to a group; "
    "then sign in again."
)

router = APIRouter(include_in_schema=False)


class Flags(TypedDict):
    """Attributes of the cookie: the provider's page sends the browser back, which a strict one would not survive."""

    httponly: bool
    samesite: Literal["lax"]
    secure: bool


def provider_of(settings: Settings) -> "Provider | None":
    """The provider of the settings, if they name one."""
    if settings.oidc.issuer is None:
        return None
    from service.access.provider import Provider

    return Provider(settings.oidc, settings.public_url or "")


@router.get("/login/provider")
async def begin(request: Request, next: Annotated[str, Query(max_length=LONGEST)] = "/") -> Response:
    """Send the browser to the provider."""
    provider, wanted = _provider(request), onward(next)
    from service.access.provider import ATTEMPT_LASTS, Attempt, SignInError

    if (waiting := must_wait(request, wanted)) is not None:
        return waiting
    attempt = Attempt.new(wanted, datetime.now(UTC))
    try:
        answer = RedirectResponse(await provider.address(attempt), 303)
    except SignInError as error:
        return _refused(request, wanted, str(error), error.status)
    name, flags = _cookie(request)
    answer.set_cookie(name, attempt.cookie, int(ATTEMPT_LASTS.total_seconds()), **flags)
    answer.headers["Cache-Control"] = "no-store"
    return answer


@router.get("/login/callback")
async def finish(
    request: Request,
    state: Annotated[str, Query(max_length=LONGEST)] = "",
    code: Annotated[str, Query(max_length=LONGEST)] = "",
    iss: Annotated[str | None, Query(max_length=LONGEST)] = None,
    error: Annotated[str, Query(max_length=LONGEST)] = "",
) -> Response:
    """Begin the session of a person whom the provider sends back, and go on to the page that was wanted."""
    provider = _provider(request)
    from service.access.provider import Attempt, SignInError, shown_code

    if (waiting := must_wait(request, "/")) is not None:
        return waiting
    attempt = Attempt(request.cookies.get(_cookie(request)[0], ""))
    if not attempt.is_answered_by(state, datetime.now(UTC)):
        return await _counted(request, "/", NOT_BEGUN, 400)
    wanted = onward(attempt.onward)
    if error or not code:
        reason = f"The provider refused the sign-in: {shown_code(error)}."
        return await _counted(request, wanted, reason, 403)
    try:
        person = await provider.person(attempt, code, iss)
    except SignInError as problem:
        return await _counted(request, wanted, str(problem), problem.status)
    return await _begun(request, provider, attempt, person, wanted)


async def _begun(request: Request, provider: "Provider", attempt: "Attempt", person: "Person", wanted: str) -> Response:
    """A session for the person, if their groups have a role."""
    if person_caller(provider.settings, person.name, person.groups) is None:
        groups = (
            ", ".join(person.groups[:20]) or f"none (the claim {provider.settings.groups_claim!r} is absent or empty)"
        )
        reason = NO_ROLE.format(name=person.name.partition(":")[2], groups=groups)
        return await _counted(request, wanted, reason, 403, person=person.name, subject=person.subject)
    cookie = await to_thread.run_sync(_new_session, request, provider, person, attempt.state)
    if cookie is None:
        return await _counted(request, wanted, USED, 400)
    # Not a redirect: a browser that comes from the provider's page would not send the strict cookie with it.
    answer = page(request, "signed_in", onward=wanted, person=person.name.partition(":")[2])
    answer.headers.update(SECRETIVE)
    keep(request, answer, cookie)
    _forget(request, answer)
    return answer


def _new_session(request: Request, provider: "Provider", person: "Person", state: str) -> str | None:
    """Value of the new session's cookie; None if the state was used before."""
    now = datetime.now(UTC)
    end = now + timedelta(seconds=provider.settings.session_lifetime)
    try:
        with request.app.state.sessions.begin() as session:
            begun = logins.begin_signed_in(session, person.name, provider.issuer, person.groups, state, now, end)
            if begun is None:
                return None
            note_session(session, request, begun, subject=person.subject, groups=list(person.groups))
            return begun.cookie
    except IntegrityError:  # another request with the same state was quicker
        return None


async def _counted(request: Request, wanted: str, reason: str, status: int, **details: object) -> Response:
    """A refusal that counts against the address and is in the audit trail."""
    request.app.state.attempts.refuse(address_of(request))

    def write() -> None:
        with request.app.state.sessions.begin() as session:
            note_session(session, request, None, reason=reason, **details)

    await to_thread.run_sync(write)
    return _refused(request, wanted, reason, status)


def _refused(request: Request, wanted: str, reason: str, status: int) -> Response:
    """The login form with the reason; whoever tries again begins anew."""
    answer = login_form(request, wanted, Refused("login", words=reason, status=status))
    answer.headers.update(SECRETIVE)
    _forget(request, answer)
    return answer


def _provider(request: Request) -> "Provider":
    provider: Provider | None = request.app.state.provider
    if provider is None:
        raise NotFoundError("sign-in provider", "in the settings (oidc.issuer)")
    return provider


def _cookie(request: Request) -> tuple[str, Flags]:
    """Name and attributes of the cookie of a sign-in that has begun."""
    secure = is_secure(request)
    return SAFE_BEGUN if secure else BEGUN, {"httponly": True, "samesite": "lax", "secure": secure}


def _forget(request: Request, answer: Response) -> None:
    name, flags = _cookie(request)
    answer.delete_cookie(name, **flags)
