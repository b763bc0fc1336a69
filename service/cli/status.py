"""`menshin status`: the verdicts on the monitored buildings."""

import json
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.text import Text

from service.cli.database import transaction
from service.cli.inputs import REFUSED, end
from service.reports.terminal import print_table

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from service.db.select import Line
    from service.verdict.assessment import Assessment

    Status = tuple[Line, Assessment]
    """(Building, its last Event | None, ...) and the verdict on the building."""

app = typer.Typer()


@app.command()
def status(
    context: typer.Context,
    building: Annotated[str | None, typer.Option(help="Code of one building, which is shown with its checks.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the verdicts as JSON, as in the API.")] = False,
) -> None:
    """Print the verdicts on the buildings, the most severe first. The exit code is 0 only if all are normal."""
    from service.buildings.store import BuildingError
    from service.verdict.checks import Level

    with transaction(context, BuildingError) as session:
        found = _statuses(session, building)
        if as_json:
            typer.echo(_json(found))
        elif building is not None:
            _print_one(found[0])
        elif found:
            _print_all(found)
    if not found:
        end("No building is monitored: add one with `menshin building add FILE`.", REFUSED)
    raise typer.Exit(0 if all(verdict.level is Level.NORMAL for _, verdict in found) else 1)


def _statuses(session: "Session", code: str | None) -> "list[Status]":
    """Those of one building or of all, the most severe first."""
    from sqlalchemy import select

    from service.buildings import store as building_store
    from service.buildings.tables import Building
    from service.verdict import overview, reading

    wanted = select(Building.id)
    if code is not None:
        wanted = wanted.where(Building.id == building_store.find(session, code).id)
    verdicts = reading.of_buildings(session, wanted)
    lines = [(line, verdicts[line.Building.id]) for line in overview.last_events(session, wanted)]
    return sorted(lines, key=lambda one: (-one[1].level.rank, one[0].Building.code))


def _json(found: "list[Status]") -> str:
    from service.verdict.schema import verdict_json

    items = [
        {
            "building": line.Building.code,
            "name": line.Building.name,
            "last_earthquake": None if line.Event is None else line.Event.start.isoformat(),
            "verdict": verdict_json(verdict),
        }
        for line, verdict in found
    ]
    return json.dumps({"items": items}, indent=2, ensure_ascii=False)


def _print_all(found: "list[Status]") -> None:
    from service.verdict import texts
    from service.verdict.checks import Outcome

    rows = []
    for line, verdict in found:
        passed = f"{len(verdict.of_outcome(Outcome.PASSED))} of {len(verdict.checks)}" if verdict.checks else "none"
        name = f"{line.Building.code}, {line.Building.name}"
        rows.append((name, texts.headline(verdict), texts.meaning(verdict), _last(line), passed))
    print_table(("building", "verdict", "what to do", "last earthquake (UTC)", "checks passed"), rows)


def _print_one(status: "Status") -> None:
    from service.verdict import terminal

    line, verdict = status
    console = Console()
    console.print(Text(f"{line.Building.code}, {line.Building.name}; last earthquake (UTC): {_last(line)}"))
    console.print(terminal.checks(verdict))


def _last(line: "Line") -> str:
    return "none" if line.Event is None else f"{line.Event.start:%Y-%m-%d %H:%M}"
