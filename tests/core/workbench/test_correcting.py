"""Records with a faulty sensor are analysed again after its correction, and the diagnosis goes on behind the fault."""

from collections.abc import Callable
from dataclasses import replace
from datetime import timedelta

import numpy as np
import pytest
from biaxial_records import biaxial_records, turned
from building_models import BASE, ROOF, paper, records, segments
from ground_motions import akt013, chi_chi, kobe
from paper_records import START

from core.analysis import AnalysisSettings, analyse
from core.arrays import Vector
from core.diagnosis.building_faults import FLOOR_SHARE, TOTAL_MASS
from core.diagnosis.missing_effects import Outcome
from core.diagnosis.sensor_faults import BuildingFault, Cause
from core.workbench.correcting import corrected_copy
from core.workbench.diagnosis_result import decisive_cause, fault_sentences
from core.workbench.earthquakes import EPOCH, Earthquakes, Recording, analysed, joined

SETTINGS = AnalysisSettings(estimator="cms")


def earthquakes(faulty: Callable[[str, Vector], Vector]) -> Earthquakes:
    each = []
    for number, motion in enumerate((akt013, chi_chi)):
        samples = {name: faulty(name, values) for name, values in records(number, motion=motion).items()}
        recorded = tuple(segments(samples, start=START + timedelta(days=number)))
        recording = Recording(recorded, paper(), SETTINGS, ("x",), EPOCH)
        each.append(analysed(f"event {number}", analyse(recorded, paper(), SETTINGS), recording))
    return joined(each, paper(), SETTINGS.band)


def reversed_base(name: str, samples: Vector) -> Vector:
    return -samples if name == BASE else samples


def loud_roof(name: str, samples: Vector) -> Vector:
    return 1.15 * samples if name == ROOF else samples


def sound(name: str, samples: Vector) -> Vector:
    return samples


def test_without_its_base_nothing_can_be_used_and_after_the_correction_everything() -> None:
    seen = earthquakes(reversed_base)
    assert seen.observations == ()
    copy = corrected_copy(seen)
    assert [(one.kind, one.channel, one.is_corrected) for one in copy.corrected] == [("polarity", BASE, True)]
    assert [one.name for one in copy.observations] == ["event 0", "event 1"]
    force, true = (one.observations[1].layer.force for one in (copy, earthquakes(sound)))
    assert np.std(force - true) < 1e-6 * np.std(true)


@pytest.mark.accuracy
def test_axes_are_turned_back_also_where_an_earthquake_does_not_show_that_they_are_turned() -> None:
    """In the noise of the last one, the floors do not determine the angle."""
    sensor, degrees = "XX.PAPER.01.HN", 33.0

    def seen(by: float) -> Earthquakes:
        each = []
        for number, (motions, noise) in enumerate(
            (((akt013, kobe), 0.01), ((kobe, akt013), 0.01), ((chi_chi, kobe), 0.3))
        ):
            description, samples = biaxial_records(*motions, noise)
            recorded = tuple(segments(turned(samples, sensor, by), start=START + timedelta(days=number)))
            recording = Recording(recorded, description, SETTINGS, ("x", "y"), EPOCH)
            each.append(analysed(f"event {number}", analyse(recorded, description, SETTINGS), recording))
        return joined(each, description, SETTINGS.band)

    found = seen(degrees)
    assert ["rotation" in {one.kind for one in here.quality} for here in found.analyses] == [True, True, False]
    copy = corrected_copy(found)
    assert {(one.kind, one.channel, one.is_corrected) for one in copy.corrected} == {
        ("rotation", f"{sensor}{axis}", True) for axis in "XY"
    }
    assert corrected_copy(seen(0.0)).corrected == ()
    errors = [
        np.std(one.analyses[2].directions["y"].restoring_force.force - true) / np.std(true)
        for true in [seen(0.0).analyses[2].directions["y"].restoring_force.force]
        for one in (found, copy)
    ]
    assert errors[1] < 0.01 < 1.0 < errors[0]


def test_a_gain_is_corrected_to_its_own_uncertainty() -> None:
    copy = corrected_copy(earthquakes(loud_roof))
    (fault,) = copy.corrected
    assert (fault.kind, fault.channel) == ("gain", ROOF)
    assert fault.std is not None
    assert abs(fault.value - 0.15) < 4 * fault.std
    peaks = [one.analysis.peaks[ROOF] for one in copy.sources if one.analysis is not None]
    true = [one.analysis.peaks[ROOF] for one in earthquakes(sound).sources if one.analysis is not None]
    assert peaks == pytest.approx(true, rel=4 * fault.std)


def test_sound_records_stay_as_they_are() -> None:
    seen = earthquakes(sound)
    assert corrected_copy(seen) is seen


def test_records_that_are_not_at_hand_cannot_be_corrected() -> None:
    seen = earthquakes(loud_roof)
    alone = replace(seen, sources=tuple(replace(one, recording=None) for one in seen.sources))
    assert corrected_copy(alone) is alone


GAIN = BuildingFault(Cause.SENSOR, "gain", ROOF, 0.15, 0.01, "reads 15 % too much")
CLIPPED = BuildingFault(Cause.SENSOR, "clipping", ROOF, 3.0, None, "lies flat")
SOFT = BuildingFault(Cause.SUPERSTRUCTURE, "storey", "3F", -0.3, 0.03, "is softer")
TOTAL = BuildingFault(Cause.MASS, TOTAL_MASS, None, 0.1, 0.02, "all forces are too large")
SHARE = BuildingFault(Cause.MASS, FLOOR_SHARE, None, 0.2, 0.02, "the floors have too much", is_corrected=True)


@pytest.mark.parametrize(
    ("faults", "outcome", "cause"),
    [
        ((GAIN,), Outcome.EFFECT, Cause.SENSOR),
        ((replace(GAIN, is_corrected=True),), Outcome.EFFECT, None),
        ((replace(GAIN, is_corrected=True),), Outcome.NOTHING_MISSING, Cause.SENSOR),
        ((CLIPPED,), Outcome.FAMILY, None),
        ((CLIPPED,), Outcome.REFIT, Cause.SENSOR),
        ((CLIPPED, SOFT), Outcome.EFFECT, Cause.SUPERSTRUCTURE),
        ((SHARE,), Outcome.EFFECT, None),
        ((SHARE,), Outcome.REFIT, Cause.MASS),
        ((SHARE, TOTAL), Outcome.REFIT, Cause.MASS),
        ((SHARE, SOFT), Outcome.EFFECT, Cause.SUPERSTRUCTURE),
        ((), Outcome.EFFECT, None),
    ],
)
def test_a_corrected_fault_is_the_outcome_only_where_it_explains_the_error(
    faults: tuple[BuildingFault, ...], outcome: Outcome, cause: Cause | None
) -> None:
    assert decisive_cause(faults, outcome) is cause


def test_what_was_corrected_is_stated() -> None:
    *_, last = fault_sentences((replace(GAIN, is_corrected=True),))
    assert f"corrected for this in a copy ({ROOF})" in last
    *_, last = fault_sentences((GAIN,))
    assert last.startswith("Correct this first")
    _, _, records, forces = fault_sentences((replace(GAIN, is_corrected=True), SHARE))
    assert records.startswith(f"The records were corrected for this in a copy ({ROOF}),")
    assert forces.startswith(
        "The findings on the isolation layer below come from forces for the masses of the records."
    )


def test_wrong_masses_open_their_own_sentence() -> None:
    assert fault_sentences((SHARE,))[0] == "The masses in the building file do not fit: the floors have too much."
    assert fault_sentences((TOTAL,))[0] == "The masses in the building file may not fit: all forces are too large."
