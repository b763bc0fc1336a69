"""The clock of a real process, set while it runs: libfaketime, preloaded."""

from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path


@dataclass(frozen=True, slots=True)
class FakedClock:
    """A file that sets a process's clock ahead of the machine's; monotonic clock and file times stay true."""

    file: Path

    def ahead(self, seconds: int) -> None:
        new = self.file.with_suffix(".new")
        new.write_text(f"{seconds:+d}\n")
        new.replace(self.file)

    @property
    def environment(self) -> dict[str, str]:
        return {
            "LD_PRELOAD": str(library()),
            "FAKETIME_TIMESTAMP_FILE": str(self.file),
            "FAKETIME_NO_CACHE": "1",
            "FAKETIME_DONT_FAKE_MONOTONIC": "1",
            "NO_FAKE_STAT": "1",
        }


def library() -> Path:
    """The package is used for its compiled library only: imported, it would fake this process' clock."""
    found = find_spec("libfaketime")
    assert found is not None
    assert found.origin is not None
    return next(Path(found.origin).parent.rglob("libfaketime.so.1"))
