"""Text for the spectator of the demonstration while the service works."""

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from threading import Event as Signal

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from sqlalchemy import func, select
from sqlalchemy.orm import Session, sessionmaker

from service.db.sessions import reading
from service.demo.site import CODE
from service.demo.stage import Stage, until_next
from service.demo.stiffness_loss import LAST_HEALTHY, LOSS
from service.records.tables import Event

SETTLED = ("analysed", "refused")


@dataclass(frozen=True, slots=True)
class Counts:
    """Numbers of events."""

    fetched: int
    settled: int
    """Number of analysed or rejected events."""


def counts(session: Session) -> Counts:
    """Number of all events and of those that are settled."""
    by_state = dict(session.execute(select(Event.state, func.count()).group_by(Event.state)).tuples().all())
    return Counts(sum(by_state.values()), sum(by_state.get(state, 0) for state in SETTLED))


def settled_state(session: Session, after: datetime) -> str | None:
    """Outcome of the latest event after a time: `analysed`, `refused`, or None while it is pending."""
    settled = select(Event.state).where(Event.end > after, Event.state.in_(SETTLED))
    return session.scalar(settled.order_by(Event.id.desc()).limit(1))


LOOK = 0.5  # s between two queries
LOST = """\
[bold]The isolators lost {loss:.0%} of their stiffness in the earthquake of {when:%Y-%m-%d %H:%M} UTC.[/] What the \
service makes of it:
  {address}/buildings/{code}/drift   what was expected, and what came
  {address}/buildings/{code}/alerts  messages to people"""


def bars(console: Console) -> Progress:
    """Progress bars, one for each stage."""
    columns = (TextColumn("{task.description:<32}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    return Progress(*columns, console=console)


def narrate(
    next_after: timedelta, stage: Stage, sessions: sessionmaker[Session], stop: Signal, console: Console
) -> None:
    """Show how past earthquakes are fetched and analysed, then how a new one arrives."""
    narrate_past(len(stage.earthquakes), reading(sessions), stop, console)
    _show_next(next_after, stage, sessions, stop, console)


def narrate_loss(
    address: str, next_after: timedelta, stage: Stage, sessions: sessionmaker[Session], stop: Signal, console: Console
) -> None:
    """Show the same, and then the building's verdict and where to see it."""
    narrate_past(len(stage.earthquakes), reading(sessions), stop, console)
    if len(stage.earthquakes) > LAST_HEALTHY:
        when = stage.earthquakes[LAST_HEALTHY - 1].arrival
        console.print(LOST.format(loss=LOSS, when=when, address=address, code=CODE), highlight=False, soft_wrap=True)
    _show_next(next_after, stage, sessions, stop, console)


def _show_next(
    next_after: timedelta, stage: Stage, sessions: sessionmaker[Session], stop: Signal, console: Console
) -> None:
    wait = until_next(stage.earthquakes, datetime.now(UTC), next_after)
    console.print(f"one more earthquake will happen in {wait.total_seconds():.0f} s")
    if stop.wait(wait.total_seconds()):
        return
    narrate_next(stage, reading(sessions), stop, console)


def narrate_past(count: int, sessions: sessionmaker[Session], stop: Signal, console: Console) -> None:
    """Show how past earthquakes are fetched and analysed."""
    with bars(console) as bar:
        fetching, analysing = (bar.add_task(name, total=count) for name in ("fetching records", "analysing events"))
        while not stop.wait(LOOK):
            with sessions() as session:
                progress = counts(session)
            bar.update(fetching, completed=progress.fetched)
            bar.update(analysing, completed=progress.settled)
            if progress.settled >= count:
                return


def narrate_next(stage: Stage, sessions: sessionmaker[Session], stop: Signal, console: Console) -> None:
    """Show how a new earthquake arrives."""
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
