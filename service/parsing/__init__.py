"""Files from outside are parsed in a child process with limits, which can be killed."""

from service.parsing.process import Limits, ParserDiedError, ParserFailedError, covered, limits, origins, read

__all__ = ["Limits", "ParserDiedError", "ParserFailedError", "covered", "limits", "origins", "read"]
