"""What the commands of `menshin model` take."""

from pathlib import Path
from typing import Annotated

import typer

Building = Annotated[Path, typer.Option(exists=True, dir_okay=False, help="Building file (TOML).")]
Model = Annotated[Path, typer.Argument(exists=True, dir_okay=False, metavar="MODEL", help="Model file (TOML).")]
Files = Annotated[
    list[Path],
    typer.Argument(
        exists=True,
        dir_okay=False,
        metavar="FILE...",
        help="Records as `menshin analyse` takes them; files that overlap in time are one earthquake.",
    ),
]
Json = Annotated[Path | None, typer.Option(dir_okay=False, help="Write all numbers here, in SI units.")]
Html = Annotated[Path | None, typer.Option(dir_okay=False, help="Write text, tables and pictures here, as one file.")]
Output = Annotated[Path, typer.Option("--output", "-o", dir_okay=False, help="Model file (TOML) to write.")]
HoldOut = Annotated[
    list[Path] | None,
    typer.Option(
        "--hold-out",
        exists=True,
        dir_okay=False,
        help="A record of an earthquake that nothing is fitted to, on which the result is tried; any number of times.",
    ),
]
