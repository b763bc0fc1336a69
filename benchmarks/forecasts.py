"""Coverage of forecasts: models fitted to weaker earthquakes of buildings with a hidden effect, and a stronger one.

    python -m benchmarks.forecasts              all trials of odd seeds, into docs/models/forecasts.md
    python -m benchmarks.forecasts --choose     even seeds, by which the constants were chosen; onto the screen
    python -m benchmarks.forecasts --quick      a few, onto the screen

Needs `pip install '.[test]'`. Every trial is kept in a file as it is done, so that a run that was stopped goes on where
it was. The model has no hidden effect: it is the design's, its values fitted to the weaker earthquakes.
"""

import json
from argparse import ArgumentParser
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from math import log
from pathlib import Path

import numpy as np
from rich.progress import track

from benchmarks.diagnosis_trial import Trial, analysed, trial  # isort: skip  (it finds hidden)

from benchmarks.table import Table, with_results
from core.analysis import EventAnalysis
from core.errors import CoreError
from core.fitting.observation import observations
from core.forecasting.ground_motion import GroundMotion
from core.forecasting.response import Setting
from core.model.first_model import first_model
from core.workbench.earthquakes import Earthquakes
from core.workbench.fitting import fit
from core.workbench.forecasting import forecaster

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "models" / "forecasts.md"
ROWS = ROOT / "build" / "forecasts.jsonl"
CASES = (
    "nothing",
    "nothing",
    "hardening",
    "moat",
    "asymmetry",
    "strain_softening",
    "temperature_stiffness",
    "stiffness_step",
    "residual_offset",
    "power_viscous",
    "relief",
    "maxwell",
    "displacement_damping",
    "inerter",
    "resonator",
    "friction",
    "breakaway",
    "second_hysteresis",
    "self_centring",
    "sharpness",
    "degradation",
    "pinching",
    "biaxial",
    "mullins",
    "heating",
    "vertical_load",
    "temperature_strength",
    "hardening_sinh",
    "hardening_tangent",
    "moat_smooth",
    "moat_hertz",
    "asymmetry_one_sided",
    "strain_softening_exponential",
    "temperature_stiffness_straight",
    "stiffness_step_break",
    "stiffness_step_decay",
    "power_viscous_two_slopes",
    "logarithmic_viscous",
    "relief_smooth",
    "maxwell_ladder",
    "displacement_damping_straight",
    "resonator_on_slab",
    "inerter_on_spring",
    "smooth_friction",
    "friction_lugre",
    "breakaway_slow",
    "second_hysteresis_bilinear",
    "second_hysteresis_ozdemir",
    "self_centring_sharp",
    "sharpness_dahl",
    "pinching_slip_lock",
    "biaxial_circular",
    "offset_left_aside",
    "mullins_power",
    "degradation_exponential",
    "heating_reciprocal",
    "vertical_load_friction",
    "temperature_strength_straight",
    "delayed_feedback",
    "wavy_force",
    "random_sticking",
    "two_masses",
    "negative_bump",
    "fractional_derivative",
)
"""The index gives the seed: others go to the end."""
TESTS = (((0, 1, 3, 4), 2), ((0, 1, 3), 4), ((0, 1, 3), 2))
"""Earthquakes that are fitted, and the stronger one that is forecast; about 4, 20, 80, 30 and 50 mm by date."""
NAMES = {((0, 1, 3, 4), 2): "4 to 50 mm, forecast 80", ((0, 1, 3), 4): "4 to 30 mm, forecast 50"} | {
    ((0, 1, 3), 2): "4 to 30 mm, forecast 80"
}
QUICK = 3


@dataclass(frozen=True, slots=True)
class Row:
    """One peak of one forecast."""

    case: str
    seed: int
    test: int
    """Index of TESTS."""
    quantity: str
    level: str
    truth: float
    """Without the sensors' errors, SI."""
    value: float
    low: float
    high: float
    beyond: tuple[str, ...]
    reach: float
    """Displacement in the forecast over the largest that was fitted."""


def rows(case: str, seed: int) -> Iterator[Row]:
    """The forecasts of one trial; none where too few earthquakes can be used."""
    made = trial(case, seed)
    analyses = [analysed(event, made) for event in made.events]
    for number, (fitted, target) in enumerate(TESTS):
        yield from _rows(made, analyses, number, fitted, target)


def _rows(
    made: Trial, analyses: Sequence[EventAnalysis], number: int, fitted: tuple[int, ...], target: int
) -> Iterator[Row]:
    every = [observations(analyses[at], made.description, f"earthquake {at}", made.events[0].start) for at in fitted]
    seen = [one for each in every for one in each if one.direction == "x"]
    if not seen:
        return
    event, description = made.events[target], made.description
    model = fit(first_model(description).isolator, seen).model
    by, _ = forecaster(model, Earthquakes.of(seen))
    shaken = GroundMotion.of("stronger", event.record.rate, x=event.ground[0], z=event.vertical)
    after = max(event.start, by.experience.last)
    found = by.forecast(shaken, None, Setting(at=after, temperature=event.temperature))
    levels = [description.base.name, *(level.name for level in description.floors)]
    truth = {("displacement", ""): event.displacement[0]}
    truth |= {("acceleration", level): event.acceleration[0, row] for row, level in enumerate(levels)}
    reach = found.peak("displacement").value / by.experience.displacement
    for peak in found.peaks:
        if (exact := truth.get((peak.quantity, peak.level))) is not None:
            measured = float(np.abs(exact).max())
            yield Row(
                made.case,
                made.seed,
                number,
                peak.quantity,
                peak.level,
                measured,
                peak.value,
                peak.low,
                peak.high,
                found.beyond,
                reach,
            )


def run(trials: Sequence[tuple[str, int]], kept: Path) -> None:
    """Run the trials that are not kept yet; a trial that no model can be fitted to is kept as its reason."""
    kept.parent.mkdir(parents=True, exist_ok=True)
    there = {(case, seed) for case, seed, _ in read(kept)}
    missing = [one for one in trials if one not in there]
    with kept.open("a", encoding="utf-8") as lines:
        for case, seed in track(missing, "forecasting"):
            try:
                found = [asdict(one) for one in rows(case, seed)]
            except CoreError as error:
                found = [{"error": str(error)}]
            lines.write(json.dumps([case, seed, found]) + "\n")
            lines.flush()


def read(kept: Path) -> list[tuple[str, int, list[dict[str, object]]]]:
    """Stored trials: case, seed and rows."""
    if not kept.exists():
        return []
    return [(case, seed, found) for case, seed, found in map(json.loads, kept.read_text("utf-8").splitlines())]


def tables(trials: Sequence[tuple[str, int, list[dict[str, object]]]]) -> list[Table]:
    """Share of forecasts whose interval contains the truth, those in range and those that say that they are not."""
    failed = [one for _, _, found in trials for one in found if "error" in one]
    every = [Row(**one) for _, _, found in trials for one in found if "error" not in one]  # type: ignore[arg-type]
    fitted = [(str(number), name) for number, name in enumerate(NAMES.values())]
    count = sum(one.quantity == "displacement" for one in every)
    about = (
        f"{len(trials)} buildings, each with a different hidden effect or none, and {count} forecasts; {len(failed)} "
        "could not be made. Contained: the 95 % interval contains the true peak. Width: half the width of the "
        "interval, median. Missed: not contained, and not stated to be out of range."
    )
    columns = ("fitted, forecast", "peak", "forecasts", "out of range", "in range: contained", "width", "missed")
    lines = []
    for number, name in [*fitted, ("", "all")]:
        for quantity in ("displacement", "acceleration"):
            own = [one for one in every if one.quantity == quantity and number in ("", str(one.test))]
            lines.append((name, quantity, *_cells(own)))
    return [Table("Coverage", about, columns, tuple(lines))]


def _cells(own: Sequence[Row]) -> tuple[str, ...]:
    within = [one for one in own if not one.beyond]
    held = [one for one in within if one.low <= one.truth <= one.high]
    missed = len(within) - len(held)
    width = float(np.median([log(one.high / one.low) / 2 for one in within])) if within else 0.0
    share = f"{100 * len(held) / len(within):.1f} %" if within else ""
    out = f"{100 * (len(own) - len(within)) / len(own):.0f} %" if own else ""
    return str(len(own)), out, share, f"± {100 * width:.0f} %", f"{100 * missed / max(1, len(own)):.1f} %"


def main() -> None:
    """Run what is missing, and write the page."""
    parser = ArgumentParser(prog="python -m benchmarks.forecasts", description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="a few cases, onto the screen")
    parser.add_argument("--choose", action="store_true", help="even seeds instead; onto the screen")
    parser.add_argument("--rows", type=Path, default=ROWS, help="where the trials are kept")
    given = parser.parse_args()
    parity = 0 if given.choose else 1
    wanted = [(case, 2 * number + parity) for number, case in enumerate(CASES)][: QUICK if given.quick else None]
    run(wanted, given.rows)
    text = "\n".join(table.markdown() for table in tables([one for one in read(given.rows) if one[1] % 2 == parity]))
    if given.quick or given.choose:
        print(text)
        return
    PAGE.write_text(with_results(PAGE.read_text("utf-8"), "benchmarks.forecasts", text), "utf-8")
    print(PAGE)


if __name__ == "__main__":
    main()
