"""Commands that run the service or a part of it."""

import errno
import socket
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.database import opened, transaction
from service.cli.inputs import REFUSED, current_settings, end

if TYPE_CHECKING:
    from sqlalchemy.orm import Session, sessionmaker

    from service.retention.pruning import Prunable
    from service.settings import Settings

app = typer.Typer(no_args_is_help=True)


@app.command()
def up(
    workers: Annotated[int | None, typer.Option(help="Number of analyses that run at the same time.")] = None,
    port: Annotated[int | None, typer.Option(help="Port of the API.")] = None,
) -> None:
    """Run everything in one process tree: API, poller, worker and notifier."""
    from service.roles import running, stop_signal
    from service.serving import address, api_in_own_process, listening

    settings = current_settings(port=port, workers=workers)
    check_port(settings)
    with (
        listening(settings) as door,
        stop_signal() as stop,
        running(settings, stop, poll=True, work=True, notify=True) as sessions,
    ):
        if not stop.is_set():
            invite(sessions, settings.public_url or address(settings, door))
        api_in_own_process(settings, stop, door)


@app.command()
def login(context: typer.Context) -> None:
    """Print a link that logs a browser in as an admin. It works once, within an hour; earlier links become invalid."""
    from datetime import UTC, datetime

    from service.access import logins

    settings = current_settings()
    with transaction(context) as session:
        token = logins.new_link(session, datetime.now(UTC))
    typer.echo(f"{(settings.public_url or f'http://{settings.host}:{settings.port}').rstrip('/')}/login?token={token}")


def invite(sessions: "sessionmaker[Session]", address: str) -> None:
    """Print a login link, as long as no key was ever made: it is the only way in."""
    from datetime import UTC, datetime

    from service.access import logins
    from service.access.keys import has_had_keys

    with sessions.begin() as session:
        if has_had_keys(session):
            return
        token = logins.new_link(session, datetime.now(UTC))
    typer.echo(f"Log in as admin (this link works once, within an hour): {address.rstrip('/')}/login?token={token}")


@app.command()
def api(port: Annotated[int | None, typer.Option(help="Port of the API.")] = None) -> None:
    """Run the API and its pages alone."""
    from service.roles import running, stop_signal
    from service.serving import address, api, listening

    settings = current_settings(port=port)
    check_port(settings)
    with listening(settings) as door, stop_signal() as stop, running(settings, stop) as sessions:
        if not stop.is_set():
            invite(sessions, settings.public_url or address(settings, door))
        api(settings, stop, door)


@app.command()
def poll(
    once: Annotated[bool, typer.Option("--once", help="Poll every source once, then end.")] = False,
) -> None:
    """Fetch new records from every building's source."""
    from service.roles import migrated, running, stop_signal, wait_for

    settings = current_settings()
    if once:
        from service.records.source_poller import SourcePoller

        with migrated(settings) as sessions:
            SourcePoller(sessions, settings).poll_all()
        return
    with stop_signal() as stop, running(settings, stop, poll=True):
        wait_for(stop)


@app.command()
def work(
    once: Annotated[bool, typer.Option("--once", "--until-idle", help="End when no job waits.")] = False,
    workers: Annotated[int | None, typer.Option(help="Number of analyses that run at the same time.")] = None,
    executor: Annotated[
        str | None,
        typer.Option(help="Where analyses run: `local`, in processes of this machine, or `dask`, in a cluster."),
    ] = None,
    dask_address: Annotated[
        str | None, typer.Option(help="Address of the cluster's scheduler, such as tcp://scheduler:8786.")
    ] = None,
) -> None:
    """Analyse the waiting events."""
    from service.roles import migrated, running, stop_signal, wait_for, work_until_idle

    settings = current_settings(workers=workers, executor=executor, dask_address=dask_address)
    if once:
        with migrated(settings) as sessions:
            typer.echo(f"{work_until_idle(sessions, settings)} jobs done")
        return
    with stop_signal() as stop, running(settings, stop, work=True):
        wait_for(stop)


@app.command()
def notify(
    once: Annotated[bool, typer.Option("--once", "--until-idle", help="End when no message is due.")] = False,
) -> None:
    """Deliver the waiting messages."""
    from service.roles import migrated, running, stop_signal, wait_for

    settings = current_settings()
    if once:
        from service.notify.notifier import Notifier

        with migrated(settings) as sessions:
            typer.echo(f"{Notifier(sessions, settings).run_until_idle()} attempts made")
        return
    with stop_signal() as stop, running(settings, stop, notify=True):
        wait_for(stop)


@app.command("import")
def import_files(
    context: typer.Context,
    files: Annotated[list[Path], typer.Argument(exists=True, dir_okay=False, help="Records or StationXML.")],
    building: Annotated[str, typer.Option(help="Code of the building.")],
) -> None:
    """Import files into the database, as the poller does."""
    from service.buildings.store import BuildingError, find
    from service.records import events
    from service.records.source_poller import SourcePoller
    from service.records.sources.source import Arrival

    refused = False
    with opened(context) as sessions:
        poller = SourcePoller(sessions, current_settings())
        try:
            with sessions() as session:
                row = find(session, building)
        except BuildingError as error:
            raise typer.BadParameter(str(error)) from None
        arrivals = tuple(Arrival(name=f.name, origin=str(f.resolve()), data=f.read_bytes()) for f in files)
        for recording in poller.receive(row, arrivals):
            typer.echo(f"{recording.name}: {recording.state}{f': {recording.reason}' if recording.reason else ''}")
            refused = refused or recording.state != "read"
        with sessions.begin() as session:
            events.queue_now(session, row, poller.clock())
    raise typer.Exit(1 if refused else 0)


@app.command()
def prune(
    context: typer.Context,
    dry_run: Annotated[bool, typer.Option(help="Only print what would be deleted, and why the rest is kept.")] = False,
    compact: Annotated[
        bool, typer.Option(help="Rewrite the file of an SQLite database without its free pages; writers wait for it.")
    ] = False,
) -> None:
    """Delete what the retention settings allow to delete, kind by kind and in small steps.

    Everything that a verdict, an alert, a baseline, a current model or an inspection refers to is kept. The service may
    run meanwhile.
    """
    from service.db import room
    from service.db.sessions import reading
    from service.retention import pruning

    settings, now = current_settings(), datetime.now(UTC)
    with opened(context) as sessions:
        if dry_run:
            with reading(sessions)() as session:
                found = pruning.prunable(session, settings, now)
        else:
            found = pruning.prune(sessions, settings, now)
        for one in found:
            typer.echo(_pruned(one, "would be deleted" if dry_run else "are deleted"))
        if not dry_run:
            typer.echo(room.give_back(sessions, whole=compact))


def _pruned(one: "Prunable", verb: str) -> str:
    """A line about a kind."""
    if one.age is None:
        return f"{one.kind}: all are kept; {one.setting} is not set"
    kept = "".join(f"\n  {count} older ones stay: {why}" for why, count in one.kept.items())
    return f"{one.kind}: {one.rows} {verb}, {one.size / 1e6:.1f} MB; {one.setting} = {one.age:g} s{kept}"


@app.command("settings")
def show_settings() -> None:
    """Show the current value of every setting and its origin."""
    from service.documents.text import print_table

    rows = [(one.name, one.value, one.origin, one.description) for one in current_settings().explained()]
    print_table(("setting", "value", "from", "meaning"), rows)


def check_port(settings: "Settings") -> None:
    """End the command with a reason and exit code 1 if the API cannot be served at the settings' host and port."""
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    try:
        socket.create_server((settings.host, settings.port), family=family).close()
    except OSError as error:
        end(_port_problem(settings.host, settings.port, error), REFUSED)


def _port_problem(host: str, port: int, error: OSError) -> str:
    another = "choose another by MENSHIN_PORT or --port"
    if error.errno == errno.EADDRINUSE:
        return f"port {port} of {host} is in use by another process; end that process, or {another}"
    if error.errno in (errno.EACCES, errno.EPERM):
        return f"this account may not listen at port {port} of {host}; {another}, of 1024 or more"
    if error.errno == errno.EADDRNOTAVAIL:
        return f"{host} is not an address of this machine; correct MENSHIN_HOST: 127.0.0.1 and 0.0.0.0 always are"
    if isinstance(error, socket.gaierror):
        return f"the host {host!r} is not known; correct MENSHIN_HOST: 127.0.0.1 and 0.0.0.0 are always there"
    return f"nothing can be served at port {port} of {host}: {error.strerror or error}; {another}"
