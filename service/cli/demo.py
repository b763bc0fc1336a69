"""`menshin demo`: a simulated building behind a real monitoring server, watched as a real one would be."""

import os
from pathlib import Path
from typing import Annotated

import typer

OWN = {"MENSHIN_DATABASE_URL", "MENSHIN_HOST", "MENSHIN_PORT", "MENSHIN_POLLING__INTERVAL"}
"""Variables in whose place the demonstration has values of its own."""

app = typer.Typer(no_args_is_help=True)


@app.command()
def demo(
    folder: Annotated[
        Path | None,
        typer.Option(file_okay=False, help="Folder of the demonstration; default: the user's data folder."),
    ] = None,
    port: Annotated[
        int,
        typer.Option(
            min=0,
            max=65535,
            help="Port of the pages and the API; 0: any free port. If it is in use, another one is taken.",
        ),
    ] = 8000,
    earthquakes: Annotated[
        int | None,
        typer.Option(
            min=2,
            max=500,
            help="Number of earthquakes in the past three years, if the folder has none yet; default: 48, and 6 with "
            "--hidden-effect.",
        ),
    ] = None,
    next_after: Annotated[float, typer.Option(min=0, help="Seconds until the next earthquake.")] = 60.0,
    hidden_effect: Annotated[
        bool,
        typer.Option(
            "--hidden-effect",
            help="Simulate a building whose isolators do something that its model lacks; find out what on the pages. "
            "One more earthquake follows once a better model is current. Kept in a subfolder.",
        ),
    ] = False,
    stiffness_loss: Annotated[
        bool,
        typer.Option(
            "--stiffness-loss",
            help="Simulate a building with a thermometer, whose isolators lose 8 % of their stiffness in the 24th "
            "earthquake; see the alert and its evidence. Kept in a subfolder.",
        ),
    ] = False,
    reset: Annotated[bool, typer.Option("--reset", help="Delete the folder's contents and start again.")] = False,
) -> None:
    """Monitor a simulated base-isolated building: recorded ground motions, a real monitoring server, the whole service.

    A second start continues where the first one ended.
    """
    from datetime import UTC, datetime, timedelta
    from functools import partial

    from platformdirs import user_data_path
    from rich.console import Console

    from service.demo.earthquakes import MotionsMissingError, recorded
    from service.demo.guide import guide
    from service.demo.narration import bars, narrate, narrate_loss
    from service.demo.performance import address, perform, settings_of
    from service.demo.scenario import BY_DESIGN, HIDDEN_EFFECT, STIFFNESS_LOSS
    from service.demo.server import free_port
    from service.demo.stage import forget, prepared

    console = Console()
    if hidden_effect and stiffness_loss:
        typer.echo("--hidden-effect and --stiffness-loss are two different buildings; choose one of them", err=True)
        raise typer.Exit(2)
    scenario = HIDDEN_EFFECT if hidden_effect else STIFFNESS_LOSS if stiffness_loss else BY_DESIGN
    count = earthquakes or scenario.earthquakes
    own = "hidden-effect" if hidden_effect else "stiffness-loss" if stiffness_loss else ""
    kept = (folder or user_data_path("menshin") / "demo").resolve() / own
    try:
        if reset:
            forget(kept)
        with bars(console) as bar:
            reading = bar.add_task("reading recorded ground motions", total=1)
            motions = scenario.chosen(recorded())
            bar.advance(reading)
            striking = bar.add_task("simulating earthquakes", total=count)
            now = datetime.now(UTC)
            stage = prepared(
                kept, scenario, motions, count, now, lambda done, of: bar.update(striking, completed=done, total=of)
            )
    except MotionsMissingError as missing:
        typer.echo(str(missing), err=True)
        raise typer.Exit(1) from None
    except KeyboardInterrupt:
        raise typer.Exit(0) from None
    for name in OWN & os.environ.keys():
        console.print(f"[yellow]{name} is not used: the demonstration has a value of its own[/]")
    free = free_port(port)
    if port not in {0, free}:
        console.print(f"[yellow]port {port} is in use: port {free} is used instead[/]")
    console.print(f"kept in {kept}", soft_wrap=True)
    settings = settings_of(kept, free)
    soon = timedelta(seconds=next_after)
    tale = (
        partial(guide, address(settings))
        if hidden_effect
        else partial(narrate_loss, address(settings), soon)
        if stiffness_loss
        else partial(narrate, soon)
    )
    perform(stage, settings, tale, console)
