"""Records that an earlier command analysed are not analysed again, unless the building or the settings changed."""

from dataclasses import replace
from pathlib import Path

from core.analysis import AnalysisSettings, EventAnalysis
from service.buildings.description import read
from service.jobs.kept import Kept, kept_in
from service.jobs.stages import silent
from service.models.operations import Reading, records


def test_a_kept_analysis_is_used_for_the_same_records_building_and_settings(folder: Path, tmp_path: Path) -> None:
    building = read((folder / "building.toml").read_text("utf-8"), folder)

    def analysed(reading: Reading) -> EventAnalysis:
        (analysis,) = records([folder / "event1.mseed"], [], building, reading, silent).analyses
        return analysis

    first = Reading(("x",), None, AnalysisSettings(), "described", kept_in(tmp_path / "kept", 10**9))
    analysis = analysed(first)
    assert analysed(first) is analysis
    later = analysed(replace(first, kept=Kept(tmp_path / "kept", 10**9)))
    assert (later.directions["x"].restoring_force.force == analysis.directions["x"].restoring_force.force).all()
    assert len(list((tmp_path / "kept").iterdir())) == 1
    for other in (
        replace(first, description_sha256="changed"),
        replace(first, settings=AnalysisSettings(estimator="cms")),
    ):
        assert analysed(other) is not analysis
    assert len(list((tmp_path / "kept").iterdir())) == 3
