"""`python -m benchmarks.suspects` measures how often faulty sensors, softened storeys and wrong masses are named."""

import sys
from argparse import ArgumentParser
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "support"))  # the generator is the tests'

from hidden.case import FAULTS
from hidden.trial import Event, Trial, trial

from benchmarks.table import Table
from core.analysis import AnalysisSettings, EventAnalysis, analyse
from core.description import BuildingDescription
from core.diagnosis.building_faults import building_faults
from core.diagnosis.sensor_faults import BuildingFault
from core.fitting.data import FitData
from core.fitting.fit import Fit, fitted
from core.fitting.observation import observations
from core.model.first_model import first_model
from core.record import Segment

SOUND = ("nothing", "refit", "pink", "gains", "moving", "floor_masses", "hardening", "mullins", "maxwell", "biaxial")
"""Cases in which nothing but the isolation layer may be blamed."""
ALIKE = {"clock": {"clock", "delay"}}
"""Kinds of fault that come to the same at that size: a clock that is slow by a little is late."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """Verdict on one trial."""

    case: str
    named: bool
    """True if the fault is named: the right sensor or storey, and the right kind."""
    wrong: tuple[BuildingFault, ...]
    """Suspects that are none."""


def verdict(case: str, seed: int) -> Verdict:
    """Suspected faults of the trial, against the true ones."""
    truth = trial(case, seed)
    analyses = tuple(_analysed(event, truth.description) for event in truth.fitted)
    found = building_faults(
        analyses, truth.description, _fit(analyses, truth.description) if _explains(truth) else None
    )
    right = [suspect for suspect in found if _is_right(suspect, truth)]
    return Verdict(case, bool(right), tuple(suspect for suspect in found if suspect not in right))


def _analysed(event: Event, described: BuildingDescription) -> EventAnalysis:
    record = event.record
    rows = zip(record.channels, record.samples, strict=True)
    segments = [Segment(channel.id, record.start, record.rate, samples) for channel, samples in rows]
    return analyse(segments, described, AnalysisSettings())


def _explains(truth: Trial) -> bool:
    """True if the design's model explains everything, so that the mass is examined."""
    return not truth.hidden and not truth.faults


def _fit(analyses: Sequence[EventAnalysis], described: BuildingDescription) -> Fit:
    found = [one for n, a in enumerate(analyses) for one in observations(a, described, f"event {n}", analyses[0].start)]
    return fitted(FitData.by_noise(found), first_model(described).isolator)


def _is_right(suspect: BuildingFault, truth: Trial) -> bool:
    if suspect.kind == "storey":
        return suspect.channel == truth.softened
    if suspect.kind == "mass":
        return truth.case == "mass"
    return any(
        suspect.channel in (fault.channel, fault.other) and suspect.kind in ALIKE.get(fault.kind, {fault.kind})
        for fault in truth.faults
    )


def table(cases: Sequence[str], seeds: Sequence[int]) -> Table:
    """A row for each case."""
    return Table(
        "Sensors, storeys and mass",
        f"Seeds {', '.join(map(str, seeds))} of each case; four earthquakes in a trial.",
        ("case", "trials", "named", "with something wrong named"),
        tuple(_rows(cases, seeds)),
    )


def _rows(cases: Sequence[str], seeds: Sequence[int]) -> Iterator[tuple[str, ...]]:
    for case in cases:
        verdicts = [verdict(case, seed) for seed in seeds]
        named = "-" if case in SOUND else str(sum(one.named for one in verdicts))
        yield case, str(len(verdicts)), named, str(sum(bool(one.wrong) for one in verdicts))


def main() -> None:
    """The table as Markdown, on the screen."""
    parser = ArgumentParser(prog="python -m benchmarks.suspects", description=__doc__)
    parser.add_argument("cases", nargs="*", default=[*FAULTS, "storey", "mass", *SOUND], help="as in gain@RF or storey")
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(1, 20, 2)), help="odd ones by default")
    given = parser.parse_args()
    print(table(given.cases, given.seeds).markdown())


if __name__ == "__main__":
    main()
