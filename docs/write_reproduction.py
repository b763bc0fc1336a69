"""Writes docs/reproduction.md and docs/reproduction.html: `python docs/write_reproduction.py`, beside ../shared/data.

The page shows section 7 only: figures of section 8 would hold the real building's records, which stay where they are.
"""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

HERE = Path(__file__).resolve().parent
RECORDS = Path("../shared/data/bncs")
"""From the top of the checkout."""
TESTS = ("CNP100", "LAC100", "SP100")


def menshin_reproduce(*arguments: object) -> None:
    """Run the command at the top of the checkout."""
    call = "from service.cli import app; app()"
    subprocess.run([sys.executable, "-c", call, "reproduce", *map(str, arguments)], cwd=HERE.parent, check=True)


def write() -> None:
    """Both documents."""
    menshin_reproduce("--output", HERE / "reproduction.html")
    with TemporaryDirectory() as folder:
        files = [RECORDS / f"{test}.mseed" for test in TESTS]
        pages = ("--output", Path(folder) / "page.html", "--markdown", HERE / "reproduction.md")
        menshin_reproduce(*files, "--building", RECORDS / "building.toml", *pages)


if __name__ == "__main__":
    write()
