"""Time that an engineer waits in `menshin demo --hidden-effect` for the diagnosis, and for the version with the effect.

    OMP_NUM_THREADS=1 python benchmarks/waiting.py

A Chromium presses "Find what ... lacks" on the page of the latest earthquake as soon as the demonstration names it, and
"Add" on the diagnosis. The time ends when the page with the result is there. The demonstration is then ended and
started again: its processes are new, its analyses are kept. Processor time is that of the service, all its processes
together; on a machine with other work it is what two versions can be compared by.
"""

import os
import re
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import psutil
from playwright.sync_api import Page

sys.path.append(str(Path(__file__).resolve().parents[1] / "docs" / "tools"))

from write_tutorial import Demonstration, demonstration, window


def processor_time(of: Demonstration) -> float:
    """s, of the demonstration's processes; those that ended are left out."""
    first = psutil.Process(of.process.pid)
    return sum(sum(one.cpu_times()[:2]) for one in (first, *first.children(recursive=True)))


def waited(what: str, of: Demonstration, act: Callable[[], object]) -> None:
    """Print the time, by the clock and of the processors, that passes until an action has its result."""
    begun, before = perf_counter(), processor_time(of)
    act()
    took, used = perf_counter() - begun, processor_time(of) - before
    processors = f"{used:5.1f}" if used > 0 else "    –"  # a process that ended took its time with it
    print(f"{what:<40} {took:5.1f} s, {processors} s of processors", flush=True)


def pressed(page: Page, name: str, leads_to: str) -> None:
    """Press a button, and wait until the browser shows a page of this address."""
    page.get_by_role("button", name=name).first.click()
    page.wait_for_url(leads_to)
    page.locator("h2").first.wait_for()


def main() -> None:
    os.environ["OMP_NUM_THREADS"] = "1"
    with TemporaryDirectory() as folder, window() as page:
        for start in ("first start", "second start"):
            with demonstration(Path(folder)) as shown:
                said = shown.until(lambda said: re.search(r"open its latest earthquake, (\S+/events/\d+)", said))
                event = said[1]
                for number in ("first", "second"):
                    page.goto(event)
                    find = f"{start}, {number} diagnosis"
                    waited(find, shown, lambda: pressed(page, "Find what", "**/diagnoses/*"))
                waited(f"{start}, version with the effect", shown, lambda: pressed(page, "Add", "**/models/*"))


if __name__ == "__main__":
    main()
