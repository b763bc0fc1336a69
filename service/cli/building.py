"""`menshin building`: the monitored buildings."""

import getpass
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.database import transaction
from service.cli.inputs import (
    REFUSED,
    current_settings,
    description_digest,
    end,
    kept_analyses,
    read_building,
    read_text,
    refusals,
    say_kept,
    write_json,
    write_text,
)
from service.documents.text import print_table

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from service.buildings.tables import Building

app = typer.Typer(no_args_is_help=True, help="The monitored buildings.")

File = Annotated[Path, typer.Argument(exists=True, dir_okay=False, readable=True, help="Building file (TOML).")]
Code = Annotated[str, typer.Argument(help="Code of the building.")]


@app.command()
def add(context: typer.Context, file: File) -> None:
    """Add a building to be monitored."""
    from service.buildings import store as building_store

    text = read_text(file)
    with _session(context, file) as session:
        building = building_store.add(session, text, file.parent.resolve(), datetime.now(UTC))
        typer.echo(f"{building.code} is monitored: {building.name}")
        _warn(session, building)


@app.command("list")
def every(context: typer.Context) -> None:
    """List the monitored buildings."""
    from sqlalchemy import select

    from service.buildings import store as building_store
    from service.buildings.tables import Building

    rows = []
    with _session(context) as session:
        for building in session.scalars(select(Building).order_by(Building.code)):
            number = str(building_store.current(session, building).number)
            rows.append((building.code, building.name, number, f"{building.created_at:%Y-%m-%d %H:%M}"))
    print_table(("code", "name", "revision", "since (UTC)"), rows)


@app.command()
def show(context: typer.Context, code: Code) -> None:
    """Print the latest description of a building, without secrets."""
    from service.addresses import without_credentials
    from service.buildings import recipients, store as building_store

    with _session(context) as session:
        row = building_store.find(session, code)
        rules = building_store.described(session, row).receivers
        text = recipients.without_secrets(building_store.current(session, row).toml, rules)
        typer.echo(without_credentials(text), nl=False)


@app.command()
def update(context: typer.Context, code: Code, file: File) -> None:
    """Update a building's description; earlier results keep theirs."""
    from service.buildings import description, store as building_store

    text, folder = read_text(file), file.parent.resolve()
    with _session(context, file) as session:
        building_store.find(session, code)
        described = description.read(text, folder).description.code
        if described != code:
            raise building_store.BuildingError(f"{file} describes building {described!r}; name a file of {code!r}")
        revision = building_store.update_description(session, text, folder, datetime.now(UTC))
        typer.echo(f"{code} is described by revision {revision.number}")
        _warn(session, revision.building)


@app.command()
def sensors(
    file: File,
    records: Annotated[
        list[Path],
        typer.Argument(
            exists=True,
            dir_okay=False,
            metavar="RECORD...",
            help="Records in the formats of `menshin analyse`; files that overlap in time are one earthquake.",
        ),
    ],
    json: Annotated[Path | None, typer.Option(dir_okay=False, help="Write all numbers here, in SI units.")] = None,
) -> None:
    """Show by how much one more accelerometer at each level would narrow the force and the modes.

    The standard deviations are those of the building's own records, with the superstructure as calibrated from each of
    them and with noise of the new channel like that of the others. No database is needed. Exit code 0: shown; 1: no
    record can be used.
    """
    from core.analysis import AnalysisSettings
    from core.workbench.added_sensors import added_sensors
    from service.analyses.added_sensors import document
    from service.analyses.store import kept_analysis
    from service.records.event_files import events

    described, own = read_building(file), current_settings().analysis
    settings = AnalysisSettings(estimator=own.estimator, rate=own.rate, band=own.band, integral=own.integral)
    kept, digest = kept_analyses(), description_digest(file)
    with refusals():
        each = [
            kept_analysis(one.segments, described.description, digest, settings, kept)
            for one in events(records, described)
        ]
        found = added_sensors(each, described.description, settings)
    say_kept(kept)
    typer.echo(str(found))
    if json is not None:
        write_json(document(found).model_dump(), json)


@app.command()
def inspect(
    context: typer.Context,
    code: Code,
    result: Annotated[str, typer.Option(help="fit (for normal use), restricted or unfit (not for use).")],
    comment: Annotated[str, typer.Option(help="Findings, restrictions, work done.")],
    name: Annotated[str | None, typer.Option(help="Name of the inspector; default: this account's.")] = None,
    at: Annotated[
        str | None, typer.Option(help="Time of the inspection, such as 2024-05-01T14:30:00+09:00; default: now.")
    ] = None,
) -> None:
    """Record an inspection of a building, signed by this account; it cannot be changed later."""
    from service.alerts import inspections
    from service.buildings import store as building_store
    from service.errors import ConflictError
    from service.times import read_time
    from service.verdict import reading, texts
    from service.verdict.assessment import Result

    now = datetime.now(UTC)
    if result not in {one.value for one in Result}:
        raise typer.BadParameter(f"{result!r} is not a result; use one of {', '.join(Result)}", param_hint="--result")
    if not comment.strip():
        raise typer.BadParameter("say what was found", param_hint="--comment")
    try:
        made_at = now if at is None else read_time(at)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--at") from None
    account = getpass.getuser()
    by = account if name is None else f"{name} ({account})"
    age = timedelta(seconds=current_settings().notify.max_event_age)
    with transaction(context, building_store.BuildingError, ConflictError) as session:
        building = building_store.find(session, code)
        inspections.record(session, building, by, Result(result), comment.strip(), made_at, age, now)
        session.flush()
        typer.echo(f"{code}: {texts.inspected(reading.of_building(session, building))}")


@app.command()
def draft(
    station: Annotated[str, typer.Argument(help="StationXML file, or address of an FDSN server.")],
    only: Annotated[
        list[str] | None,
        typer.Option("--station", help="Code of a station in the building, or NETWORK.STATION; may be repeated."),
    ] = None,
    network: Annotated[str, typer.Option(help="Code of the network, for a server.")] = "*",
    code: Annotated[str | None, typer.Option(help="Code of the building; default: the first station's.")] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="File to write; default: print it.")] = None,
) -> None:
    """Write a draft of a building file from StationXML or an FDSN server, and mark what is missing."""
    from service.addresses import without_credentials
    from service.buildings.draft import draft as drafted
    from service.buildings.station_metadata import StationError, stations
    from service.records.sources.source import SourceError

    is_server = station.startswith(("http://", "https://"))
    try:
        data = _of_server(station, network, only or ()) if is_server else Path(station).read_bytes()
        found = stations(without_credentials(station), data, only or (), datetime.now(UTC))
    except (StationError, SourceError) as error:
        end(str(error), REFUSED)
    location = without_credentials(station).split("/fdsnws")[0] if is_server else None
    text = drafted(found, code or found.names[0].partition(".")[2], location)
    if output is None:
        typer.echo(text, nl=False)
    else:
        write_text(text, output)
        typer.echo(f"{output}: fill in what is marked, then `menshin building add {output}`", err=True)


def _of_server(address: str, network: str, stations: Sequence[str]) -> bytes:
    """StationXML from a server; an address with a query is requested as it is."""
    from time import monotonic, sleep

    from service.records.sources.opening import login, without_login
    from service.records.sources.retried_requests import Manners, client
    from service.records.sources.source import SourceError

    settings = current_settings()
    manners = Manners(sleep, settings.polling.retries, monotonic() + settings.polling.timeout)
    named = ",".join(one.rpartition(".")[2] for one in stations) or "*"
    parameters = {"network": network, "station": named, "level": "channel"}
    is_query = "/fdsnws/station/1/query?" in address
    query = address if is_query else f"{address.split('/fdsnws')[0].rstrip('/')}/fdsnws/station/1/query"
    if not is_query and (network, named) == ("*", "*"):
        raise SourceError("name the station in the building with --station: a server may have thousands")
    made = client(settings, manners, logins=dict(filter(None, [login(address)])))
    try:
        answer = made.get(without_login(query), None if is_query else parameters)
    finally:
        made.http.close()
    if answer.is_empty:
        raise SourceError(f"{address} has no station {named} of network {network}; correct --station and --network")
    return answer.body


def _warn(session: "Session", building: "Building") -> None:
    """Warn of a folder that is not there yet, and of mail that cannot be sent; neither is an error."""
    from service.buildings import store as building_store

    source = building_store.described(session, building).source
    if source is not None and source.kind == "folder" and not os.path.isdir(source.location):
        typer.echo(
            f"warning: the folder {source.location} does not exist; "
            "create it, or correct location in the building file",
            err=True,
        )
    if current_settings().smtp.host is None and any(
        receiver.kind == "email" for receiver in building_store.described(session, building).receivers
    ):
        typer.echo("warning: no mail can be sent to the building's mail receivers: set smtp.host", err=True)


@contextmanager
def _session(context: typer.Context, file: Path | None = None) -> Iterator["Session"]:
    """A transaction on the database; a refusal ends the command with exit code 1. Problems of the file name it."""
    from service.buildings.description import BuildingFileError
    from service.buildings.store import BuildingError

    with transaction(context, BuildingFileError, BuildingError) as session:
        try:
            yield session
        except BuildingFileError as error:
            raise BuildingError(f"{file}:\n{error}") from error
