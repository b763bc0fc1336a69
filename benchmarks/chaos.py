"""Kills random processes of the service while earthquakes arrive, and compares the outcome with a run without kills.

    OMP_NUM_THREADS=1 python -m benchmarks.chaos [--kills 1000] [--seed 1] [--database sqlite|postgresql] [--minutes 60]

Poller, worker, API and notifier run as separate commands with a database in a temporary folder, and are restarted when
they exit, as by systemd. An HTTP server provides the records of two buildings. After its first earthquake one building
has no channel on the roof, which must raise an alert. A mail server and a webhook receive the messages. At random
moments SIGKILL hits one of the four processes, a child of the worker's pool, or the database. PostgreSQL is then
restarted. SQLite has no process, so another program locks the file for longer than a statement waits. The leases of a
killed process end at once, as if their time had passed. A job may fail 30 times instead of three: kills are far more
frequent than in reality, and one analysis is hit more than once. Every process of the service is a copy (`fork`) of
one that has imported everything, with its own number: most of a start's processor time was its imports. The exit code
is 1 if anything was lost, duplicated without being marked as a repeat, left unfinished, or left running.
"""

import json
import random
import signal
import sys
from collections import Counter
from contextlib import ExitStack
from datetime import UTC, datetime, timedelta
from pathlib import Path
from time import monotonic, sleep
from types import FrameType
from typing import Annotated

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "support"))  # servers and records are the tests'

import databases
import typer

from benchmarks.chaos_comparison import Difference, Outcome, differences, outcome
from benchmarks.chaos_service import VICTIMS, Database, Run, service
from benchmarks.table import Table

KILLS_PER_EVENT = 16
FEWEST = 8
"""Smallest number of earthquakes per building."""
REPORTED = 20
"""Kills between two progress lines."""
GAP = (0.3, 2.0)
"""s between two kills."""


def calm_run(run: Run, count: int, begin: datetime) -> None:
    """Let all earthquakes arrive without kills."""
    for part in run.parts.values():
        part.start()
    run.arrive(count, begin)
    run.until_quiet()


def killing_run(run: Run, kills: int, count: int, begin: datetime, rng: random.Random, seconds: float) -> None:
    """Kill `kills` processes while the earthquakes arrive, or fewer if `seconds` pass first."""
    start, done = monotonic(), 0
    while done < kills and monotonic() - start < seconds:
        for part in run.parts.values():
            part.start()
        share = max((done + 1) / kills, (monotonic() - start) / seconds)
        run.arrive(min(count, round(count * share)), begin)
        sleep(rng.uniform(*GAP))
        run.ask()
        victim = rng.choice(VICTIMS)
        if run.kill(victim, rng):
            run.kills[victim] += 1
            done += 1
            if done % REPORTED == 0:
                typer.echo(f"{done} kills in {monotonic() - start:.0f} s", err=True)
    run.arrive(count, begin)
    run.until_quiet()


def finished(run: Run) -> tuple[Outcome, list[str]]:
    """The contents of the database after the run, and the processes that are still running."""
    left = run.end()
    found: Outcome = run.at_database(outcome)
    return found, left


def report(calm: Outcome, chaos: Outcome, run: Run, found: list[Difference], kind: Database) -> Table:
    """Table of the counts of both runs and of their differences."""
    repeats = sum(len(all_of) - 1 for got in run.received().values() for all_of in got.values())
    counted = Counter(one.kind for one in found)
    tables = ("recordings", "events", "analyses", "alerts", "messages")
    rows = [(name, str(getattr(calm, name).total()), str(getattr(chaos, name).total())) for name in tables]
    rows += [("analyses that a later one superseded", str(calm.superseded), str(chaos.superseded))]
    rows += [("starts of processes", "4", str(sum(part.starts for part in run.parts.values())))]
    rows += [("messages that came again and said so", "0", str(repeats))]
    rows += [(f"**{name}**", "", str(counted[name])) for name in ("lost", "doubled", "stuck", "left", "wrong")]
    kills = ", ".join(f"{name} {run.kills[name]}" for name in VICTIMS)
    return Table(f"{run.kills.total()} kills on {kind}", f"Killed: {kills}.", ("", "calm", "with kills"), tuple(rows))


def main(
    kills: Annotated[int, typer.Option(min=1, help="Number of kills.")] = 1000,
    seed: Annotated[int, typer.Option(help="Seed of the random moments and victims.")] = 1,
    database: Annotated[Database, typer.Option(help="Kind of database.")] = Database.SQLITE,
    minutes: Annotated[float, typer.Option(min=0.1, help="Time after which no further kill is made.")] = 60.0,
    output: Annotated[Path | None, typer.Option(help="File for the result as JSON.")] = None,
) -> None:
    """Kill processes while earthquakes arrive, and compare the outcome with a run without kills."""

    def end(number: int, frame: FrameType | None) -> None:
        typer.echo(f"ended by {signal.Signals(number).name}, nothing was compared", err=True)
        raise KeyboardInterrupt

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, end)
    rng, count = random.Random(seed), max(FEWEST, kills // KILLS_PER_EVENT)
    begin = datetime.now(UTC).replace(microsecond=0) - timedelta(hours=40)
    with ExitStack() as stack:
        postgres = None
        if database is Database.POSTGRESQL:
            postgres = stack.enter_context(databases.own_server())
            databases.prepare(postgres.get_uri(), databases.KILLABLE)
        with service(database, postgres) as run:
            calm_run(run, count, begin)
            calm, left = finished(run)
            found = [Difference("wrong", f"the calm run: {note}") for note in (*run.notes, *left, *calm.unfinished)]
            typer.echo("the calm run has ended", err=True)
        with service(database, postgres) as run:
            killing_run(run, kills, count, begin, rng, 60 * minutes)
            chaos, left = finished(run)
            found += differences(calm, chaos, run.received(), left)
            found += [Difference("wrong", note) for note in run.notes]
            log = (run.folder / "output").read_text(errors="replace")
        table = report(calm, chaos, run, found, database)
    typer.echo(table.markdown())
    for one in found:
        typer.echo(f"{one.kind}: {one.subject}")
    if output is not None:
        about = {
            "database": str(database),
            "seed": seed,
            "kills": dict(run.kills),
            "rows": [list(r) for r in table.rows],
        }
        about["differences"] = [[one.kind, one.subject] for one in found]
        output.write_text(json.dumps(about, indent=1) + "\n")
        if found:
            output.with_suffix(".log").write_text(log)
    raise typer.Exit(1 if found else 0)


if __name__ == "__main__":
    typer.run(main)
