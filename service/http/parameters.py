"""Parameters of requests: one definition for all routes."""

from datetime import datetime
from typing import Annotated, Literal

from fastapi import Depends, Path, Query, Request
from pydantic import BeforeValidator, WithJsonSchema
from sqlalchemy.orm import Session, sessionmaker

from service.access import auth
from service.access.auditing import AuditContext, audited
from service.access.scope import limited
from service.db.select import Span
from service.http.request_capture import captured
from service.times import read_time

LARGEST = 2**31 - 1
"""Largest number of a row: that of a 32-bit integer column."""

Time = Annotated[
    datetime,
    BeforeValidator(read_time),
    WithJsonSchema({"type": "string", "format": "date-time", "examples": ["2010-02-27T06:34:11Z"]}),
]
Code = Annotated[str, Path(description="Code of the building.", pattern=r"^[A-Za-z0-9_-]{1,32}$", examples=["BNCS"])]
Id = Annotated[int, Path(description="Number of the event.", ge=1, le=LARGEST, examples=[1])]
ModelId = Annotated[int, Path(description="Number of the model.", ge=1, le=LARGEST, examples=[1])]
JobId = Annotated[int, Path(description="Number of the job.", ge=1, le=LARGEST, examples=[1])]
ReceiverId = Annotated[int, Path(description="Number of the receiver.", ge=1, le=LARGEST, examples=[1])]
MessageId = Annotated[int, Path(description="Number of the message.", ge=1, le=LARGEST, examples=[1])]
KeyId = Annotated[int, Path(description="Number of the key.", ge=1, le=LARGEST, examples=[1])]
LinkId = Annotated[int, Path(description="Number of the link.", ge=1, le=LARGEST, examples=[1])]
DeliveryId = Annotated[int, Path(description="Number of the delivery.", ge=1, le=LARGEST, examples=[1])]
ChannelId = Annotated[
    str,
    Path(description="Id of the channel.", pattern=r"^[!-.0-~]{1,64}$", examples=["XX.BNCS.01.HNX"]),
]
MinimumPga = Annotated[
    float | None,
    Query(description="m/s², least peak horizontal ground acceleration.", ge=0, allow_inf_nan=False, examples=[0.5]),
]
HorizontalDirection = Annotated[
    Literal["x", "y"], Query(description="Horizontal direction, as the building file names it.")
]
AnyModelDirection = Annotated[Literal["x", "y", "xy"] | None, Query(description="Only models of this direction.")]
AnyModelState = Annotated[
    Literal["draft", "current", "retired"] | None, Query(description="Only models in this state.")
]
AnyDirection = Annotated[Literal["x", "y"] | None, Query(description="Only this horizontal direction.")]
AnalysisId = Annotated[
    int | None, Query(description="Number of an earlier analysis; without it the latest one.", ge=1, le=LARGEST)
]
Points = Annotated[
    int | None,
    Query(
        description="Thin the series to at most this many samples, keeping the extremes of every pixel of each series; "
        "without it every sample is answered.",
        ge=32,
        le=1_000_000,
        examples=[2000],
    ),
]


def span_of_request(
    after: Annotated[
        Time | None, Query(description="Only events that start then or later (UTC unless a zone is given).")
    ] = None,
    before: Annotated[Time | None, Query(description="Only events that start before that.")] = None,
) -> Span:
    """The span of time in a request."""
    return Span(after=after, before=before)


async def reading_sessions(request: Request) -> sessionmaker[Session]:
    """Sessions that only read, limited to the caller's buildings."""
    return limited(request.app.state.reading, lambda: auth.caller(request))


async def writing_sessions(request: Request) -> sessionmaker[Session]:
    """Sessions that may write, limited to the caller's buildings; the audit trail records their changes."""

    def audit_context() -> AuditContext:
        address = request.client.host if request.client else "unknown"
        return AuditContext(
            auth.caller(request).name, address, request.method, request.url.path, captured(request.scope)
        )

    return limited(audited(request.app.state.sessions, audit_context), lambda: auth.caller(request))


EventSpan = Annotated[Span, Depends(span_of_request)]
Reading = Annotated[sessionmaker[Session], Depends(reading_sessions)]
Writing = Annotated[sessionmaker[Session], Depends(writing_sessions)]
