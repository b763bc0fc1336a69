"""How much a client may post."""

from fastapi import Request

from service.errors import TooLargeError


async def text(request: Request, most: int) -> str:
    """The posted text; what is not UTF-8 in it is replaced.

    Raises
    ------
    TooLargeError
        It is longer than `most` bytes; the rest of it is not read.
    """
    body = bytearray()
    async for chunk in request.stream():
        body += chunk
        if len(body) > most:
            raise TooLargeError(f"The posted text is longer than {most} bytes; several shorter ones would do.")
    return body.decode("utf-8", "replace")
