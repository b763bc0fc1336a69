"""Coverage-guided fuzzing of one reader: `python tests/support/fuzz.py CSV -max_total_time=600`.

It needs `pip install atheris`, which the tests do without. A file that ends in anything but a record or a refusal is
kept as crash-<sha1> in the working directory. Options after the format are libFuzzer's.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import atheris

with atheris.instrument_imports(include=["service.formats", "obspy.io"]):
    from fuzz_inputs import FILES, GAINS

    from service.formats import FormatError, read

LARGEST = 20_000  # bytes of a file that is made
SLOWEST = 10  # s that one file may take
MEMORY = 2048  # MiB


def take(data: bytes) -> None:
    """Read what was made; anything but a refusal goes on to the fuzzer."""
    try:
        read("a", data, GAINS)
    except FormatError:
        return


def main() -> None:
    """Fuzz one format, beginning with a valid file of it."""
    kind, *options = sys.argv[1:]
    with TemporaryDirectory() as corpus:
        Path(corpus, "valid").write_bytes(FILES[kind])
        bounds = (f"-max_len={LARGEST}", f"-timeout={SLOWEST}", f"-rss_limit_mb={MEMORY}")
        atheris.Setup([sys.argv[0], *bounds, *options, corpus], take)
        atheris.Fuzz()


if __name__ == "__main__":
    main()
