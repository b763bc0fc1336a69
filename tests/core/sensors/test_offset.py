"""Resting levels: noted where far from zero, mended with a warning where an acceleration's jumps."""

import numpy as np
import pytest
from described import BASE, FOURTH, GROUND, LAYER, ROOF, bncs, bncs_segments, paper, records, segments
from shared import needs_shared

from core.analysis import AnalysisSettings, EventAnalysis, analyse


def analysed(samples: dict[str, np.ndarray]) -> EventAnalysis:
    return analyse(segments(samples), paper(), AnalysisSettings())


def found(result: EventAnalysis) -> list[tuple[str, str, str | None]]:
    """Of screening: a jump that is taken out leaves traces, on which the estimator may remark."""
    of_screening = [finding for finding in result.quality if finding.kind != "estimator"]
    return [(finding.kind, finding.severity, finding.channel) for finding in of_screening]


@pytest.mark.parametrize(
    ("channel", "rest", "words"), [(BASE, 0.031, "3.1"), (ROOF, -0.2, "-20"), (LAYER, 0.012, "12")]
)
def test_a_channel_that_rests_far_from_zero_is_noted_in_both_units(channel: str, rest: float, words: str) -> None:
    samples, healthy = records(1), analysed(records(1))
    samples[channel] = samples[channel] + rest
    result = analysed(samples)
    assert found(result) == [("offset", "note", channel)]
    assert result.quality[0].value == pytest.approx(rest, rel=0.02)
    assert f"({words}" in result.quality[0].message  # gal or mm
    force, same = (each.directions["x"].restoring_force.force for each in (healthy, result))
    assert same == pytest.approx(force, abs=1e-6 * np.abs(force).max())


@pytest.mark.parametrize("channel", [GROUND, BASE, FOURTH, ROOF])
@pytest.mark.parametrize("step", [0.02, -0.1])
def test_a_jump_of_an_accelerations_level_is_measured_and_taken_out(channel: str, step: float) -> None:
    samples, healthy = records(2), analysed(records(2))
    samples[channel] = samples[channel] + np.where(np.arange(18000) < 5230, 0, step)
    result = analysed(samples)
    assert found(result) == [("offset", "warning", channel)]
    # Both levels are means over motion that 5 s do not average out: some 3 mm/s².
    assert result.quality[0].value == pytest.approx(step, abs=0.003)
    force, near = (each.directions["x"].restoring_force.force for each in (healthy, result))
    # The instant is known to a fraction of a second, the level to 3 %: a short pulse of the step is left.
    assert np.linalg.norm(near - force) < 0.05 * np.linalg.norm(force)


def test_a_displacement_that_rests_elsewhere_after_the_event_is_no_fault() -> None:
    samples = records(3)
    samples[LAYER] = samples[LAYER] + 0.0005 * (np.arange(18000) > 6000)
    assert found(analysed(samples)) == []


@needs_shared
def test_a_jump_in_a_record_of_the_real_building() -> None:
    pieces = bncs_segments("CNP100")
    for piece in pieces:
        if piece.channel == "XX.BNCS.04.HNX":
            piece.samples[3000:] += 0.05
    result = analyse(pieces, bncs(), AnalysisSettings())
    warnings = [one for one in found(result) if one[1] != "note"]  # that displacement is an integral is noted too
    assert warnings == [("offset", "warning", "XX.BNCS.04.HNX")]
    assert len(found(result)) == 2
