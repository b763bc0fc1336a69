"""Whether an answer of waveforms is whole, and which times of which channels it holds."""

from collections.abc import Iterable

from service import parsing
from service.formats import FormatError, UnknownUnitError
from service.formats.coverage import Piece
from service.parsing import Limits, ParserDiedError, ParserFailedError

__all__ = ["Piece", "pieces", "problem"]


def problem(name: str, body: bytes, limits: Limits) -> str | None:
    """Why these are no whole waveforms; None if they are, whatever their units, or if they are too much for a parser.

    What is too much is given up when it is taken in, after a few attempts, and must not be fetched for ever.
    """
    try:
        parsing.read(name, body, {}, limits)
    except (UnknownUnitError, ParserDiedError, ParserFailedError):
        return None
    except FormatError as error:
        return str(error)
    return None


def pieces(bodies: Iterable[bytes], limits: Limits) -> tuple[Piece, ...]:
    """What there is in whole waveforms; nothing in those that are too much for a parser."""
    found: list[Piece] = []
    for body in bodies:
        try:
            found += parsing.covered("an answer", body, limits)
        except (FormatError, ParserDiedError, ParserFailedError):
            continue
    return tuple(found)
