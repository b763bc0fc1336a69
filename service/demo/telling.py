"""What the demonstration tells its spectator while the service works."""

from datetime import UTC, datetime, timedelta
from threading import Event as Signal

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from sqlalchemy.orm import Session, sessionmaker

from service.db.sessions import reading
from service.demo import memory
from service.demo.outcome import counts, settled_state
from service.demo.site import CODE
from service.demo.stage import Stage
from service.demo.stiffness_loss import LAST_HEALTHY, LOSS

LOOK = 0.5  # s between two looks at the database
LOST = """\
[bold]The isolators lost {loss:.0%} of their stiffness in the earthquake of {when:%Y-%m-%d %H:%M} UTC.[/] What the \
service makes of it:
  {address}/buildings/{code}/drift   what was expected, and what came
  {address}/buildings/{code}/alerts  what people are told"""


def bars(console: Console) -> Progress:
    """Progress bars, one for each stage."""
    columns = (TextColumn("{task.description:<32}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    return Progress(*columns, console=console)


def tell(next_after: timedelta, stage: Stage, sessions: sessionmaker[Session], stop: Signal, console: Console) -> None:
    """How the past is fetched and analysed; then one more earthquake, and how it arrives by itself."""
    tell_of_the_past(len(stage.earthquakes), reading(sessions), stop, console)
    _tell_of_the_next(next_after, stage, sessions, stop, console)


def tell_of_a_loss(
    address: str, next_after: timedelta, stage: Stage, sessions: sessionmaker[Session], stop: Signal, console: Console
) -> None:
    """The same, and what became of the building, and where that shows."""
    tell_of_the_past(len(stage.earthquakes), reading(sessions), stop, console)
    if len(stage.earthquakes) > LAST_HEALTHY:
        when = stage.earthquakes[LAST_HEALTHY - 1].arrival
        console.print(LOST.format(loss=LOSS, when=when, address=address, code=CODE), highlight=False, soft_wrap=True)
    _tell_of_the_next(next_after, stage, sessions, stop, console)


def _tell_of_the_next(
    next_after: timedelta, stage: Stage, sessions: sessionmaker[Session], stop: Signal, console: Console
) -> None:
    wait = memory.until_next(stage.earthquakes, datetime.now(UTC), next_after)
    console.print(f"one more earthquake will happen in {wait.total_seconds():.0f} s")
    if stop.wait(wait.total_seconds()):
        return
    tell_of_one_more(stage, reading(sessions), stop, console)


def tell_of_the_past(count: int, sessions: sessionmaker[Session], stop: Signal, console: Console) -> None:
    """How so many earthquakes are fetched and analysed."""
    with bars(console) as bar:
        fetching, analysing = (bar.add_task(name, total=count) for name in ("fetching records", "analysing events"))
        while not stop.wait(LOOK):
            with sessions() as session:
                found = counts(session)
            bar.update(fetching, completed=found.fetched)
            bar.update(analysing, completed=found.settled)
            if found.settled >= count:
                return


def tell_of_one_more(stage: Stage, sessions: sessionmaker[Session], stop: Signal, console: Console) -> None:
    """One more earthquake, and how it arrives by itself."""
    fresh = stage.strike(datetime.now(UTC))
    peak = 100 * fresh.peak
    console.print(
        f"[bold]an earthquake of {peak:.0f} gal was recorded[/] ({fresh.motion}, scaled); it will arrive by itself"
    )
    while not stop.wait(LOOK):
        with sessions() as session:
            state = settled_state(session, fresh.arrival)
        if state is not None:
            console.print(f"it arrived and was {state}: reload the page")
            return
