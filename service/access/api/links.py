"""Links to one building in the API; for admins of the building."""

from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Body, Depends, Request, Response

from service.access import links
from service.access.auth import Caller, admin
from service.access.pages.links import public_address
from service.access.schema import LinkMade, LinkOut, LinkRequest, Links, link_out
from service.buildings import queries as building_queries
from service.http.parameters import Code, LinkId, Reading, Writing
from service.http.problems import openapi_responses
from service.http.responses import TaggedRoute, responses

router = APIRouter(tags=["operations"], route_class=TaggedRoute, dependencies=[Depends(admin)])
By = Annotated[Caller, Depends(admin)]


@router.get("/buildings/{code}/links", operation_id="list_links", **responses(Links, 404))
def of_building(code: Code, sessions: Reading) -> Links:
    """Links by which the pages of the building can be read; needs an admin's key."""
    with sessions() as session:
        building, _ = building_queries.building(session, code)
        return Links(items=[link_out(one) for one in links.every(session, building.id)])


@router.post(
    "/buildings/{code}/links",
    operation_id="make_link",
    status_code=201,
    response_model=LinkMade,
    responses=openapi_responses(400, 401, 403, 404, 422),
)
def make(
    request: Request,
    code: Code,
    sessions: Writing,
    response: Response,
    by: By,
    wanted: Annotated[LinkRequest, Body(description="Name and days.")],
) -> LinkMade:
    """Make a link by which whoever has it reads the pages of the building; needs an admin's key."""
    with sessions.begin() as session:
        building, _ = building_queries.building(session, code)
        link, token = links.create(session, building, wanted.name, by.name, datetime.now(UTC), wanted.days)
        answer = LinkMade(**link_out(link).model_dump(), address=links.address(public_address(request), token))
    response.headers["Cache-Control"] = "no-store"
    return answer


@router.delete(
    "/links/{link_id}",
    operation_id="revoke_link",
    response_model=LinkOut,
    responses=openapi_responses(400, 401, 403, 404, 422),
)
def revoke(request: Request, link_id: LinkId, sessions: Writing) -> LinkOut:
    """Revoke a link, and with it every browser that reads by it; needs an admin's key."""
    with sessions.begin() as session:
        answer = link_out(links.revoke(session, link_id, datetime.now(UTC)))
    request.app.state.callers.forget()
    return answer
