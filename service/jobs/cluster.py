"""Jobs computed by a Dask cluster, whose scheduler and workers may come and go.

A worker gets the function of a stage with its arguments as bytes, and returns the result. It needs the software of this
process and the installation's own effects; neither the settings nor the database. The scheduler needs Dask alone: it
passes the bytes on.
"""

import hashlib
import logging
import pickle
from collections.abc import Callable, Collection, Mapping
from concurrent.futures import Future
from contextlib import suppress
from functools import partial
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from service.jobs.executors import Executors, JobExecutor, LostComputationError
from service.settings.groups import Jobs

if TYPE_CHECKING:
    from distributed import Client, Future as DaskFuture, Security

log = logging.getLogger(__name__)

PACKAGES = ("menshin", "numpy", "scipy", "numba", "dask", "distributed")
"""Packages whose versions must be the same in this process and in the cluster's workers."""
OF_SCHEDULER = ("python", "dask", "distributed")
"""Packages whose versions the scheduler must share."""
LOOK = 2.0
"""s between two looks at the cluster."""
CONNECT = 5.0
"""s that an attempt to reach the scheduler may take."""
ANSWER = 20.0
"""s that a scheduler may take to answer. Where the network loses everything, the connection itself ends after 30 s."""
GRACE = 600.0
"""s without any worker after which computations are taken back. Longer than a supervisor waits before it starts a
worker that keeps dying: the scheduler counts how often a computation's worker died."""
LARGE = "1GiB"
"""Size of a computation from which Dask warns; its own 10 MB are less than a long record."""

P = ParamSpec("P")
T = TypeVar("T")
Software = Mapping[str, str]
"""Versions by name; `none` for what is not there."""


class Cluster(JobExecutor):
    """Workers of a Dask cluster, which compute while all of them have the software of this process."""

    def __init__(
        self,
        address: str,
        security: "Security | None" = None,
        effects_folder: Path | None = None,
        timer: Callable[[], float] = monotonic,
    ) -> None:
        self._address, self._security, self._timer = address, security, timer
        self._software, self._guarded = travelling(effects_folder)
        self._own = self._software()
        self._client: Client | None = None
        self._given: dict[Future[Any], DaskFuture[Any]] = {}
        self._seen: dict[str, Software | None] = {}
        """Software of the workers by address; None: it could not be asked yet."""
        self._looked_at = -float("inf")
        self._since_alone: float | None = None
        """s of the timer since when there has been no worker."""
        self._trouble: str | None = None

    def trouble(self) -> str | None:
        """Obstacle to the cluster's computing, and its remedy; connects to its scheduler where necessary."""
        if self._client is not None and self._client.status != "running":
            self._lose_scheduler()
        if self._timer() - self._looked_at >= LOOK:
            found = self._found()
            self._looked_at = self._timer()
            if found is None and self._trouble is not None:
                log.warning("the Dask cluster at %s computes again", self._address)
            elif found is not None and found != self._trouble:
                log.warning("work waits: %s", found)
            self._trouble = found
        return self._trouble

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Compute in a worker of the cluster.

        Raises:
            LostComputationError: the scheduler cannot be reached.
        """
        if self._client is None:
            raise LostComputationError(f"no connection to the Dask scheduler at {self._address}")
        payload = pickle.dumps((fn, args, kwargs), pickle.HIGHEST_PROTOCOL)
        given = self._client.submit(self._guarded, payload, dict(self._own), pure=False)
        future: Future[T] = Future()
        future.set_running_or_notify_cancel()
        self._given[future] = given
        given.add_done_callback(partial(self._pass_on, future))
        return future

    def abandon(self, future: Future[Any]) -> None:
        """Forget a computation; a worker that has begun it computes to its end."""
        if (given := self._given.pop(future, None)) is not None:
            with suppress(Exception):  # the scheduler may be away
                given.cancel()

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Leave the cluster; running computations are abandoned."""
        self._take_back("this process ends")
        if self._client is not None:
            with suppress(Exception):  # the scheduler may be away
                self._client.close(timeout=CONNECT)
            self._client = None

    def _found(self) -> str | None:
        try:
            client = self._connected()
            of_scheduler = client.sync(client.scheduler.versions, callback_timeout=ANSWER)["packages"]
            there = client.scheduler_info(n_workers=-1)["workers"]
            if not there:
                there = client.nthreads()  # the other is as old as the last message of the scheduler
            self._ask_new(client, there)
        except OSError as error:  # as all errors of Dask's connections
            self._lose_scheduler()
            reason = " ".join(str(error).split()) or type(error).__name__
            away = f"the Dask scheduler at {self._address} cannot be reached ({reason})"
            return f"{away}; start it, or correct jobs.dask_address"
        if not there:
            self._wait_alone()
            return f"the Dask cluster at {self._address} has no worker; start one by `dask worker {self._address}`"
        self._since_alone = None
        return self._difference(of_scheduler)

    def _connected(self) -> "Client":
        if self._client is None:
            import dask
            from distributed import Client

            dask.config.set({"distributed.admin.large-graph-warning-threshold": LARGE})
            logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # this class says what it means
            self._client = Client(self._address, timeout=CONNECT, security=self._security, set_as_default=False)
            self._seen = {}
        return self._client

    def _ask_new(self, client: "Client", there: Collection[str]) -> None:
        """Ask workers that came, and those that did not answer, for their software."""
        self._seen = {address: self._seen.get(address) for address in there}
        new = [address for address, software in self._seen.items() if software is None]
        if new:
            for address, answer in client.run(self._software, workers=new, on_error="return").items():
                if isinstance(answer, dict):
                    self._seen[address] = answer
                elif not isinstance(answer, OSError):  # it has gone, or does not answer at this moment
                    self._seen[address] = {"menshin": f"none that could be asked ({answer})"}

    def _difference(self, of_scheduler: Mapping[str, Any]) -> str | None:
        """The first worker, or the scheduler, with other software than this process."""
        python = ".".join(str(of_scheduler.get("python", "")).split(".")[:2])
        scheduler = {name: str(of_scheduler.get(name)) for name in OF_SCHEDULER} | {"python": python}
        every: list[tuple[str, str, Software]] = [("scheduler", self._address, scheduler)]
        every += [("worker", address, software) for address, software in self._seen.items() if software is not None]
        for role, address, software in every:
            if other := different(self._own, software):
                return (
                    f"the Dask {role} at {address} has {_listed(software, other)}, and this process has "
                    f"{_listed(self._own, other)}; install the same versions in both, by one image or lock file"
                )
        return None

    def _wait_alone(self) -> None:
        now = self._timer()
        self._since_alone = self._since_alone or now
        if now - self._since_alone > GRACE:
            self._take_back(f"the Dask cluster had no worker for {GRACE:.0f} s")

    def _lose_scheduler(self) -> None:
        client, self._client, self._looked_at = self._client, None, -float("inf")
        self._take_back("the connection to the Dask scheduler was lost")
        if client is not None:
            with suppress(Exception):  # it is of no use any more
                client.close(timeout=CONNECT)

    def _take_back(self, reason: str) -> None:
        """End all computations as lost."""
        for future in list(self._given):
            given = self._given.pop(future, None)
            with suppress(Exception):  # the scheduler may be away
                if given is not None and self._client is not None:
                    given.cancel()
            _end(future, error=LostComputationError(reason))

    def _pass_on(self, future: Future[Any], given: "DaskFuture[Any]") -> None:
        """Give a computation's end to the one who waits; called by a thread of Dask."""
        if self._given.pop(future, None) is None:
            return
        if given.status == "cancelled":
            _end(future, error=LostComputationError("the Dask scheduler does not know the computation any more"))
            return
        try:
            refusal, result = given.result()
        except Exception as error:  # the function's own, or Dask's
            lost = isinstance(error, OSError) and given.status == "finished"
            _end(future, error=LostComputationError(str(error)) if lost else error)
            return
        if refusal is not None:
            self._seen, self._looked_at = {}, -float("inf")
            _end(future, error=LostComputationError(f"a Dask worker has {_listed(refusal, refusal)}"))
        else:
            _end(future, result=result)


def dask_cluster(settings: Jobs, effects_folder: Path | None = None) -> Executors:
    """The cluster that the settings name, reached with their certificates where they have some.

    Raises:
        RuntimeError: Dask is not installed.
    """
    try:
        from distributed import Security
    except ModuleNotFoundError:
        raise RuntimeError("executor = dask needs the package distributed: pip install 'menshin[dask]'") from None
    security = None  # then Dask's own configuration holds
    if settings.dask_tls_ca is not None:
        security = Security(
            tls_ca_file=str(settings.dask_tls_ca),
            tls_client_cert=str(settings.dask_tls_certificate),
            tls_client_key=str(settings.dask_tls_key),
            require_encryption=True,
        )
    cluster = Cluster(settings.dask_address or "", security, effects_folder)
    return lambda: cluster


def travelling(effects_folder: Path | None) -> tuple[Callable[[], Software], Callable[[bytes, Software], Any]]:
    """Two functions that are sent with their code, because a worker may have another Menshin or none.

    Returns:
        One that returns the software of the process that calls it; and one that computes from bytes if that software
        is the given one: the differing software and None, or None and the result.
    """
    packages, folder = PACKAGES, None if effects_folder is None else str(effects_folder)

    def software() -> dict[str, str]:
        import sys
        from importlib.metadata import PackageNotFoundError, version

        found = {"python": ".".join(map(str, sys.version_info[:2]))}
        for name in packages:
            try:
                found[name] = version(name)
            except PackageNotFoundError:
                found[name] = "none"
        try:
            from service.jobs.cluster import own_code
        except ImportError:
            return found
        return found | own_code(folder)

    def guarded(payload: bytes, expected: Software) -> tuple[dict[str, str] | None, Any]:
        there = software()
        if any(there.get(name) != value for name, value in expected.items()):
            return {name: there.get(name, "none") for name in expected if there.get(name) != expected[name]}, None
        from service.jobs.cluster import computed

        return None, computed(payload, folder)

    return software, guarded


def own_code(effects_folder: str | None) -> dict[str, str]:
    """Digests of Menshin's code and of the installation's own effects."""
    from service.version import code_digest

    effects = hashlib.sha256()
    for file in sorted(Path(effects_folder).glob("[!_]*.py")) if effects_folder else ():
        effects.update(file.name.encode() + b"\0" + file.read_bytes() + b"\0")
    return {"code": code_digest()[:12], "own effects": effects.hexdigest()[:12]}


def computed(payload: bytes, effects_folder: str | None) -> Any:  # noqa: ANN401  whatever the function returns
    """The result of a pickled function with its arguments."""
    from service.user_effects import add_user_effects

    add_user_effects(None if effects_folder is None else Path(effects_folder))
    function, args, kwargs = pickle.loads(payload)
    return function(*args, **kwargs)


def different(own: Software, other: Software) -> list[str]:
    """Names of what the other has in another version."""
    return [name for name, version in other.items() if own.get(name) != version]


def _listed(software: Software, names: Collection[str]) -> str:
    """Versions in words: `menshin 0.1.0 and numba 0.61.2`."""
    each = [f"{name} {software.get(name, 'none')}" for name in names]
    return each[0] if len(each) == 1 else f"{', '.join(each[:-1])} and {each[-1]}"


def _end(future: Future[Any], *, result: object = None, error: BaseException | None = None) -> None:
    if not future.done():
        if error is None:
            future.set_result(result)
        else:
            future.set_exception(error)
