"""`python -m benchmarks.hidden_effects CASE SEED -o FOLDER` writes records of a building that hides something."""

import sys
from argparse import ArgumentParser
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "support"))  # the generator is the tests'

from hidden.case import ANOTHER, FAULTS, FAULTS_AND_LAWS, OUTSIDE, PAIRS, SAME, WORDS
from hidden.files import write
from hidden.trial import trial

CASES = f"""\
A case is words joined by '+'.
The library's own laws: {", ".join(SAME)}.
Others of its families: {", ".join(ANOTHER)}.
Of no family: {", ".join(OUTSIDE)}.
Pairs: {", ".join(PAIRS)}, and any other two.
Sensors that err: {", ".join(FAULTS)}.
With a law: {", ".join(FAULTS_AND_LAWS[:3])}, and any other two.
The rest: {", ".join(WORDS)}."""


def main() -> None:
    """A building file, an earthquake in each miniSEED file, and hidden.json, which says what is hidden."""
    parser = ArgumentParser(prog="python -m benchmarks.hidden_effects", description=__doc__, epilog=CASES)
    parser.add_argument("case", help="what is hidden, as in friction, friction+pink, gain@RF or nothing")
    parser.add_argument("seed", type=int, help="another building and other earthquakes for each")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FOLDER", help="where the files go")
    given = parser.parse_args()
    for file in write(trial(given.case, given.seed), given.output):
        print(file)


if __name__ == "__main__":
    main()
