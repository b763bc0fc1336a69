"""Time, size and SQL statements of every page behind 5,000 earthquakes of one building and 10,000 buildings.

    OMP_NUM_THREADS=1 python benchmarks/pages.py DATABASE [--events 5000] [--buildings 10000]

DATABASE is a file of `menshin demo`, which has ended. It is copied. Its earthquakes are repeated further back in time
with new numbers and all results, of which the histories are short; its building with the last earthquake is repeated
under other codes. The pages are those that links lead to. The time is the median of five requests inside one process,
the first one not counted. The sizes are of the page, and of the page with the specifications of its charts, compressed.
"""

import gzip
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from re import findall
from statistics import median
from time import perf_counter
from typing import Annotated, Any

import numpy as np
import typer
from fastapi.testclient import TestClient
from sqlalchemy import Column, Engine, LargeBinary, Table, create_engine, event, func, insert, select

import service.app
from service.access.auth import Caller, Role
from service.db import blobs, migrate
from service.db.base import Base
from service.settings import Settings

sys.path.append(str(Path(__file__).resolve().parents[1] / "docs" / "tools"))
from walk_pages import pages

FIRST = "/buildings/DEMO"
"""Page of the building with many earthquakes."""
ROUNDS = 5
GOAL_MS, GOAL_KB = 300, 500
SHORT = blobs.encode(np.zeros(5))
"""In place of a copy's histories, which lists and trends never read."""
LARGE = {"content", "waveform"}
"""Tables that are not repeated."""
APART = timedelta(days=10)
"""Between an earthquake and its repetition."""
LOCAL = "http://127.0.0.1:8000"
Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Chain:
    """A row with all rows that depend on it, by table, in the order in which they can be inserted."""

    rows: Mapping[Table, list[Row]]

    def repeated(self, first: Mapping[Table, int], back: timedelta) -> Iterator[tuple[Table, Row]]:
        """Its rows with numbers from `first` on, times earlier by `back`, and short histories."""
        renumbered = {
            table: {row["id"]: number for number, row in enumerate(rows, first[table])}
            for table, rows in self.rows.items()
            if "id" in table.c
        }
        for table, rows in self.rows.items():
            for row in rows:
                yield table, {column.name: _changed(column, row[column.name], renumbered, back) for column in table.c}


def _changed(
    column: Column[Any], value: object, renumbered: Mapping[Table, Mapping[int, int]], back: timedelta
) -> object:
    if value is None:
        return None
    if column.primary_key and column.table in renumbered:
        return renumbered[column.table][value]  # type: ignore[index]  # a number
    for key in column.foreign_keys:
        return renumbered.get(key.column.table, {}).get(value, value)  # type: ignore[call-overload]  # a number
    if isinstance(value, bytes) and isinstance(column.type, LargeBinary):
        return SHORT
    return value - back if hasattr(value, "tzinfo") else value


def chain(engine: Engine, name: str, number: int, without: frozenset[str] = frozenset()) -> Chain:
    """The row of a table by its number, and the rows that refer to it, directly or not."""
    found: dict[Table, list[Row]] = {}
    with engine.connect() as connection:
        for table in Base.metadata.sorted_tables:
            if table.name in LARGE | without:
                continue
            if table.name == name:
                where = table.c.id == number
            else:
                own = [
                    column.in_([row["id"] for row in found[key.column.table]])
                    for column in table.c
                    for key in column.foreign_keys
                    if key.column.table in found and "id" in key.column.table.c
                ]
                if not own:
                    continue
                where = own[0] if len(own) == 1 else own[0] | own[1]
            rows = [dict(row) for row in connection.execute(select(table).where(where)).mappings()]
            if rows:
                found[table] = rows
    return Chain(found)


def repeat(engine: Engine, chains: list[Chain], count: int, change: Callable[[Table, Row, int], Row]) -> None:
    """Insert so many repetitions of the chains, taking turns."""
    numbers: dict[Table, int] = {}
    with engine.begin() as connection:
        for made in range(count):
            one = chains[made % len(chains)]
            first = {}
            for table, rows in one.rows.items():
                if table not in numbers and "id" in table.c:
                    numbers[table] = 1 + (connection.scalar(select(func.max(table.c.id))) or 0)
                if "id" in table.c:
                    first[table] = numbers[table]
                    numbers[table] += len(rows)
            together: dict[Table, list[Row]] = {}
            for table, row in one.repeated(first, (1 + made // len(chains)) * APART):
                together.setdefault(table, []).append(change(table, row, made))
            for table, rows in together.items():
                connection.execute(insert(table), rows)


def more_events(engine: Engine, count: int) -> None:
    """Repeat the building's earthquakes."""
    with engine.connect() as connection:
        table = Base.metadata.tables["event"]
        known = connection.scalars(select(table.c.id).where(table.c.state == "analysed")).all()
    without = frozenset({"alert", "alert_change", "message", "delivery", "delivery_attempt", "drift_alarm"})
    chains = [chain(engine, "event", number, without) for number in known]
    repeat(engine, chains, count - len(known), lambda table, row, made: row)


def more_buildings(engine: Engine, count: int) -> None:
    """Repeat the building with its last earthquake."""
    event_table, of_building = Base.metadata.tables["event"], "building"
    with engine.connect() as connection:
        last = connection.scalar(select(event_table.c.id).order_by(event_table.c.start.desc()).limit(1))
        building = connection.scalar(select(Base.metadata.tables[of_building].c.id))
    one = chain(engine, "event", last, frozenset({"message", "delivery", "delivery_attempt", "alert", "alert_change"}))
    own = {"building", "revision", "source_state"}
    others = frozenset(table.name for table in Base.metadata.sorted_tables) - own
    rows = {**chain(engine, of_building, building, others).rows, **one.rows}
    order = [table for table in Base.metadata.sorted_tables if table in rows]

    def renamed(table: Table, row: Row, made: int) -> Row:
        return row | {"code": f"B{made}", "name": f"Tower {made}"} if table.name == of_building else row

    repeat(engine, [Chain({table: rows[table] for table in order})], count - 1, renamed)


@dataclass(slots=True)
class Measured:
    """A page: median time, sizes, and statements of one request."""

    kind: str
    address: str
    ms: float
    page_kb: float
    whole_kb: float
    statements: int

    @property
    def reaches(self) -> bool:
        """True if the goals are reached."""
        return self.ms <= GOAL_MS and self.whole_kb <= GOAL_KB


def measured(client: TestClient, engine: Engine) -> Iterator[Measured]:
    """Every page."""
    counted: list[object] = []
    event.listen(engine, "before_cursor_execute", lambda *given: counted.append(given[2]))
    for kind, address in pages(client, (FIRST, "/")):
        counted.clear()
        answer = client.get(address)
        statements, times = len(counted), []
        for _ in range(ROUNDS):
            begun = perf_counter()
            client.get(address)
            times.append(perf_counter() - begun)
        charts = set(findall(r'data-chart="([^"]+)"', answer.text))
        size = len(gzip.compress(answer.content))
        whole = size + sum(len(gzip.compress(client.get(one.replace("&amp;", "&")).content)) for one in charts)
        yield Measured(kind, address, 1e3 * median(times), size / 1e3, whole / 1e3, statements)


def main(
    database: Annotated[Path, typer.Argument(help="Database file of a demonstration that has ended.", exists=True)],
    events: Annotated[int, typer.Option(help="Earthquakes of the first building.")] = 5_000,
    buildings: Annotated[int, typer.Option(help="Number of buildings.")] = 10_000,
) -> None:
    """A line for each page; exit code 1 if one misses a goal."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "menshin.sqlite"
        shutil.copyfile(database, file)
        migrate.upgrade(f"sqlite:///{file}")
        engine = create_engine(f"sqlite:///{file}")
        more_events(engine, events)
        more_buildings(engine, buildings)
        with engine.connect() as connection:
            connection.exec_driver_sql("ANALYZE")
        engine.dispose()
        app = service.app.create(Settings(database_url=f"sqlite:///{file}"), Caller("reader", Role.admin))
        with TestClient(app, base_url=LOCAL, client=("127.0.0.1", 50_000)) as client:
            found = list(measured(client, app.state.sessions.kw["bind"]))
    print(f"{'page':34} {'ms':>7} {'page kB':>8} {'all kB':>8} {'statements':>11}")
    for one in found:
        line = f"{one.kind:34} {one.ms:7.0f} {one.page_kb:8.0f} {one.whole_kb:8.0f} {one.statements:11d}"
        print(line, "" if one.reaches else " misses the goal")
    raise typer.Exit(0 if all(one.reaches for one in found) else 1)


if __name__ == "__main__":
    typer.run(main)
