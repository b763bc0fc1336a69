"""Write docs/operate/report.png, the picture of the report on an earthquake.

    python docs/tools/write_report.py sqlite:///menshin.sqlite --event 24

The page is drawn by the compiler that prints it, without a browser; the database may be that of a demonstration.
"""

from contextlib import ExitStack
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from service.db.sessions import reading, sessions
from service.reports import rendering
from service.reports.earthquake import earthquake_report
from service.reports.pictures import pictures

TARGET = Path(__file__).parents[1] / "operate" / "report.png"


def write(
    database: Annotated[str, typer.Argument(help="SQLAlchemy address.")],
    event: Annotated[int, typer.Option(help="Number of the earthquake.")],
) -> None:
    """Draw it."""
    opened = sessions(database)
    with ExitStack() as stack:
        stack.callback(opened.kw["bind"].dispose)
        session = stack.enter_context(reading(opened)())
        report = earthquake_report(session, event)
        drawn = pictures(session, report)
    [page] = rendering.pages(report, drawn, datetime.now(UTC))
    TARGET.write_bytes(page)


if __name__ == "__main__":
    typer.run(write)
