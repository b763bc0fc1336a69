"""Write docs/reference/reproduction.md and its page of figures: `python docs/tools/write_reproduction.py`.

It reads the real building's records in ../shared/data, from the top of the checkout. The page of figures shows section
7 only: figures of section 8 would contain those records, which are not published.
"""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).resolve().parents[2]
TARGET = ROOT / "docs" / "reference" / "reproduction.md"
RECORDS = Path("../shared/data/bncs")
"""From the top of the checkout."""
TESTS = ("CNP100", "LAC100", "SP100")


def menshin_reproduce(*arguments: object) -> None:
    """Run the command at the top of the checkout."""
    call = "from service.cli import app; app()"
    subprocess.run([sys.executable, "-c", call, "reproduce", *map(str, arguments)], cwd=ROOT, check=True)


def write() -> None:
    """Both documents."""
    menshin_reproduce("--output", TARGET.with_suffix(".html"))
    with TemporaryDirectory() as folder:
        files = [RECORDS / f"{test}.mseed" for test in TESTS]
        pages = ("--output", Path(folder) / "page.html", "--markdown", TARGET)
        menshin_reproduce(*files, "--building", RECORDS / "building.toml", *pages)


if __name__ == "__main__":
    write()
