"""Time until commands and services begin to work: imports, kept analyses, kept compiled code, and waiting processes.

    OMP_NUM_THREADS=1 python benchmarks/starting.py [FOLDER]

FOLDER holds a building file and the records of three earthquakes; by default it is that of the real building. Times of
commands are processor times of all their processes: first with nothing kept but compiled code, then again. Times of the
service are by the clock, from the start of `menshin work`, or from an import, until the analysis is stored; and, beside
them, processor times of all the service's processes, which other work on the machine changes less.
"""

import os
import resource
import subprocess
import sys
from argparse import ArgumentParser
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic, sleep

import psutil
from sqlalchemy import create_engine, text

REAL = Path(__file__).resolve().parents[2] / "shared" / "data" / "bncs"
MENSHIN = (sys.executable, "-c", "from service.cli import app; app()")
IDLE = 15.0
"""s for which a service is idle before a record arrives."""


def command(*arguments: object) -> subprocess.Popen[bytes]:
    quiet = subprocess.DEVNULL
    return subprocess.Popen((*MENSHIN, *map(str, arguments)), stdout=quiet, stderr=quiet)


def processor_time(*arguments: object) -> float:
    """s, of a command and all its processes."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    process = command(*arguments)
    if process.wait() not in (0, 1):
        raise SystemExit(f"menshin {' '.join(map(str, arguments))} ended with {process.returncode}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def starts() -> None:
    """Commands that have next to nothing to do."""
    for arguments in (("--help",), ("effects",), ("building", "list"), ("status",), ("notify", "--once")):
        took = min(processor_time(*arguments) for _ in range(3))
        print(f"menshin {' '.join(arguments):<20} {took:6.2f}", flush=True)


def work(building: Path, files: list[Path]) -> None:
    """Commands on records, the first time and again."""
    processor_time("model", "new", "--building", building, "-o", "new.toml")
    processor_time("model", "fit", "new.toml", *files, "--building", building, "-o", "fitted.toml")
    given = (*files, "--building", building)
    for name, arguments in {
        "analyse, two earthquakes": ("analyse", *files[:2], "--building", building),
        "compare, two": ("model", "compare", "fitted.toml", *files[:2], "--building", building),
        "fit, three": ("model", "fit", "new.toml", *given, "-o", "fitted.toml"),
        "add, three": ("model", "add", "friction", "fitted.toml", *given, "-o", "added.toml"),
        "diagnose, three": ("model", "diagnose", "fitted.toml", *given),
    }.items():
        os.environ["MENSHIN_JOBS__KEPT_ROOM"] = "0"
        without = processor_time(*arguments)
        del os.environ["MENSHIN_JOBS__KEPT_ROOM"]
        processor_time(*arguments)
        print(f"{name:<28} {without:6.2f} {min(processor_time(*arguments) for _ in range(2)):6.2f}", flush=True)


def analyses(count: int) -> float:
    """The instant at which so many analyses are stored, s."""
    engine = create_engine(os.environ["MENSHIN_DATABASE_URL"])
    while True:
        with engine.connect() as connection:
            if (connection.scalar(text("SELECT count(*) FROM analysis")) or 0) >= count:
                return monotonic()
        sleep(0.02)


def used(service: subprocess.Popen[bytes]) -> float:
    """s, processor time of a service and its processes so far."""
    first = psutil.Process(service.pid)
    return sum(sum(one.cpu_times()[:2]) for one in (first, *first.children(recursive=True)))


def services(building: Path, files: list[Path]) -> None:
    """The first analysis of a service with a job that waits, and of one that waits for a job."""
    Path("records").mkdir()
    own = Path("own.toml")
    own.write_text(building.read_text("utf-8").replace('location = "."', 'location = "records"'), "utf-8")
    processor_time("building", "add", own)
    code = own.read_text("utf-8").partition('code = "')[2].partition('"')[0]
    stations = sorted(building.parent.glob("*.xml"))
    processor_time("import", *stations, files[0], "--building", code)
    begun = monotonic()
    service = command("work", "--workers", 1)
    print(f"{'a job waits at the start':<28} {analyses(1) - begun:6.2f} {used(service):6.2f}", flush=True)
    sleep(IDLE)
    processor_time("import", files[1], "--building", code)
    begun, before = monotonic(), used(service)
    print(f"{'a record after 15 s':<28} {analyses(2) - begun:6.2f} {used(service) - before:6.2f}", flush=True)
    service.terminate()
    service.wait()


def main() -> None:
    parser = ArgumentParser(description="Processor time of commands, and the wait for the first analysis.")
    parser.add_argument("folder", nargs="?", default=REAL, type=Path, help="with records and a building file")
    folder = parser.parse_args().folder.resolve()
    files = sorted(folder.glob("*.mseed"))[:3]
    with TemporaryDirectory() as place:
        os.chdir(place)
        os.environ |= {"XDG_CACHE_HOME": place, "MENSHIN_DATABASE_URL": f"sqlite:///{place}/menshin.sqlite"}
        print("processor time, s")
        starts()
        print("\nprocessor time, s" + " " * 11 + " first  again")
        work(folder / "building.toml", files)
        print("\nuntil the analysis is stored, s" + " " * 3 + "processors")
        services(folder / "building.toml", files)


if __name__ == "__main__":
    main()
