"""`python -m benchmarks` writes docs/reference/benchmarks.md; with names it renews the parts of those benchmarks."""

import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType

from benchmarks import chain, identification, identification_noise, simulation
from benchmarks.machine import description
from benchmarks.table import Table

TARGET = Path(__file__).resolve().parents[1] / "docs" / "reference" / "benchmarks.md"
BENCHMARKS: Mapping[str, tuple[str, Callable[[], Iterator[Table]]]] = MappingProxyType(
    {
        "identification": ("Subspace identification of A and C", identification.tables),
        "identification_noise": ("Identification under noise", identification_noise.tables),
        "simulation": ("Simulation", simulation.tables),
        "chain": ("The whole chain for one event", chain.tables),
    }
)
"""Title of each table on the page."""

OPENING = """\
# Benchmarks

Written by

    pip install -e '.[benchmark]' && python -m benchmarks

Times are processor times on one core with one BLAS thread. Each is the median of several rounds, in which the methods
take turns, each in a separate process that may use 60 s and 6 GB. Times differ between machines and days, so only
ratios within one table are meaningful. The errors beside the times are relative to exact values.
"""


def main(names: list[str]) -> None:
    """All benchmarks, or those named, onto the screen and into the page."""
    if unknown := sorted(set(names) - set(BENCHMARKS)):
        sys.exit(f"no benchmark is called {', '.join(unknown)}; there are {', '.join(BENCHMARKS)}")
    for name in names or BENCHMARKS:
        title, tables = BENCHMARKS[name]
        part = "\n".join([f"## {title}\n", f"On {description()}\n", *(table.markdown() for table in tables())])
        print(part, flush=True)
        page = TARGET.read_text(encoding="utf-8") if TARGET.exists() else ""
        TARGET.write_text(renewed(page, {title: part}), encoding="utf-8")


def renewed(page: str, parts: Mapping[str, str]) -> str:
    """The page with the given parts by their titles in place of what it had; the others stay as they were."""
    held = {part.partition("\n")[0]: f"## {part.rstrip()}\n" for part in page.split("\n## ")[1:]} | dict(parts)
    titles = [title for title, _ in BENCHMARKS.values() if title in held]
    return "\n".join([OPENING, *(held[title] for title in titles)])


if __name__ == "__main__":
    main(sys.argv[1:])
