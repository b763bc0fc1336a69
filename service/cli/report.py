"""`menshin report`: reports for paper and for a screen."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.database import transaction
from service.language.choice import ENGLISH, LANGUAGES, known, speaking

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

app = typer.Typer()

SUFFIXES = (".pdf", ".html")


@app.command()
def report(
    context: typer.Context,
    event: Annotated[int | None, typer.Argument(metavar="[EVENT]", min=1, help="Number of an earthquake.")] = None,
    building: Annotated[str | None, typer.Option(help="Code of a building, for the report on a year.")] = None,
    year: Annotated[int | None, typer.Option(min=1900, max=2100, help="The year, with --building.")] = None,
    language: Annotated[str, typer.Option(help=f"Language of the report: {' or '.join(LANGUAGES)}.")] = ENGLISH,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "--output",
            metavar="FILE",
            help="File to write, .pdf or .html; default: a PDF in the working directory.",
        ),
    ] = None,
) -> None:
    """Write the report on an earthquake (one page), or on a building's year with --building and --year."""
    from service.errors import NotFoundError

    if (event is None) == (building is None) or (building is None) != (year is None):
        raise typer.BadParameter("give the number of an earthquake, or --building and --year")
    suffix = ".pdf" if out is None else out.suffix.lower()
    if suffix not in SUFFIXES:
        raise typer.BadParameter("a report is written as .pdf or .html", param_hint="--out")
    if (shown := known(language)) is None:
        raise typer.BadParameter(f"reports are written in {', '.join(LANGUAGES)}", param_hint="--language")
    with transaction(context, NotFoundError) as session, speaking(shown):
        if building is not None and year is not None:
            name, content = _of_year(session, building, year, suffix[1:])
        else:
            name, content = _of_earthquake(session, event or 0, suffix[1:])
    path = Path(name) if out is None else out
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    typer.echo(f"{path} is written")


def _of_earthquake(session: "Session", event: int, suffix: str) -> tuple[str, bytes]:
    """Name and content of the file."""
    from datetime import UTC, datetime

    from service.reports import earthquake, pictures, rendering

    made = earthquake.earthquake_report(session, event)
    drawn = pictures.pictures(session, made)
    return rendering.file_name(made, suffix), rendering.FORMS[suffix](made, drawn, datetime.now(UTC))


def _of_year(session: "Session", code: str, number: int, suffix: str) -> tuple[str, bytes]:
    """The same of a year."""
    from datetime import UTC, datetime

    from service.reports import pictures, rendering, year

    now = datetime.now(UTC)
    made = year.year_report(session, code, number, now)
    return rendering.file_name(made, suffix), rendering.FORMS[suffix](made, pictures.year_pictures(made), now)
