"""`menshin status`: the verdicts on the monitored buildings."""

import json
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from service.cli.database import transaction
from service.cli.inputs import REFUSED, end
from service.documents.document import Document
from service.documents.text import print_table, printed

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from service.verdict.reading import Standing

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
    raise typer.Exit(0 if all(one.verdict.level is Level.NORMAL for one in found) else 1)


def _statuses(session: "Session", code: str | None) -> "list[Standing]":
    """Verdicts on one building or on all, the most severe first."""
    from sqlalchemy import select

    from service.buildings import store as building_store
    from service.buildings.tables import Building
    from service.verdict import levels, reading

    every = select(Building.id).order_by(Building.id)
    numbers = session.scalars(every).all() if code is None else [building_store.find(session, code).id]
    some = (numbers[first : first + levels.TOGETHER] for first in range(0, len(numbers), levels.TOGETHER))
    found = [one for together in some for one in reading.standings(session, together)]
    return sorted(found, key=lambda one: (-one.verdict.level.rank, one.building.code))


def _json(found: "list[Standing]") -> str:
    from service.verdict.schema import verdict_json

    items = [
        {
            "building": one.building.code,
            "name": one.building.name,
            "last_earthquake": None if one.event is None else one.event.start.isoformat(),
            "verdict": verdict_json(one.verdict),
        }
        for one in found
    ]
    return json.dumps({"items": items}, indent=2, ensure_ascii=False)


def _print_all(found: "list[Standing]") -> None:
    from service.verdict import texts
    from service.verdict.checks import Outcome

    rows = []
    for one in found:
        verdict = one.verdict
        passed = f"{len(verdict.of_outcome(Outcome.PASSED))} of {len(verdict.checks)}" if verdict.checks else "none"
        name = f"{one.building.code}, {one.building.name}"
        rows.append((name, texts.headline(verdict), texts.meaning(verdict), _last(one), passed))
    print_table(("building", "verdict", "what to do", "last earthquake (UTC)", "checks passed"), rows)


def _print_one(one: "Standing") -> None:
    from service.verdict.report import parts

    title = f"{one.building.code}, {one.building.name}; last earthquake (UTC): {_last(one)}"
    Console().print(printed(Document(title, tuple(parts(one.verdict)))))


def _last(one: "Standing") -> str:
    return "none" if one.event is None else f"{one.event.start:%Y-%m-%d %H:%M}"
