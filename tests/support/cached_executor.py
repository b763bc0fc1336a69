"""An executor that computes equal things once, so that tests with different databases share results."""

import pickle
from collections.abc import Callable
from concurrent.futures import Executor, Future
from hashlib import sha256
from pathlib import Path
from typing import Any
from uuid import uuid4

from service.jobs.stages import Note


class CachedExecutor(Executor):
    """Computes at once, in this process, what no test of this run computed before.

    Everything around a computation is real and done each time: what goes in comes from the database, and what comes out
    is stored. Results are kept in a folder that all processes of a test run share. Exceptions are not kept.
    """

    folder: Path
    """Set once by tests/conftest.py."""

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:  # noqa: ANN401
        """A future that is done."""
        assert not named
        future: Future[Any] = Future()
        try:
            future.set_result(_once(function, arguments))
        except Exception as error:
            future.set_exception(error)
        return future


def _once(function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:  # noqa: ANN401
    file = CachedExecutor.folder / sha256(_key(function, arguments)).hexdigest()
    if file.exists():
        return pickle.loads(file.read_bytes())
    found = function(*arguments)
    written = file.with_name(uuid4().hex)
    written.write_bytes(pickle.dumps(found))
    written.replace(file)
    return found


def _key(function: Callable[..., Any], arguments: tuple[Any, ...]) -> bytes:
    """Notes, by which a computation says how far it is, have a path of their own each time."""
    return pickle.dumps((function, ["note" if isinstance(one, Note) else one for one in arguments]))
