import json
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import numpy as np
import orjson
from building_files import FOLDER, SMALL

from core.analysis import AnalysisSettings, DirectionAnalysis, EventAnalysis
from core.estimators.result import Assessment, RestoringForce
from core.identification.modes import Mode
from core.isolation_layer.equivalent import EquivalentSegment
from core.isolation_layer.layer import AxialLoad
from core.isolation_layer.motion import MeasuredMotion, ResidualDisplacement
from core.record import Finding
from service.analyses.document import file_results
from service.analyses.schema import EventOut
from service.buildings.description import read
from service.verdict.measured import of_analysis
from service.verdict.schema import verdict_out

DESCRIPTION = read(SMALL, FOLDER).description
NAN = float("nan")
MOTION = MeasuredMotion(
    displacement=np.array([0.0, -0.03, 0.02]),
    velocity=np.zeros(3),
    displacement_std=np.array([1e-3, 2e-3, 1e-3]),
    velocity_std=np.zeros(3),
    band=(0.12, 50.0),
    noise=1e-3,
)


def analysed() -> EventAnalysis:
    force = RestoringForce(
        estimator="cms",
        force=np.array([1e6, -3e6, 2e6]),
        rigid=np.array([1e6, -2e6, 1e6]),
        modal=np.array([0.0, -1e6, 1e6]),
        std=np.array([3e4, 4e4, 0.0]),
        modes=(Mode(1.09, 0.01, np.array([0.4, 1.0]), frequency_std=0.002),),
        assessment=Assessment("masses as told", 1.1, is_at_rest=True, prior_share=0.2),
    )
    found = DirectionAnalysis(
        restoring_force=force,
        motion=MOTION,
        equivalent=(
            EquivalentSegment(1.0, 3.0, 0.02, 0.1, 5e6, 1e5, 2e5, 1e4),
            EquivalentSegment(3.0, 5.0, 0.01, 0.05, 5e6, 1e5, NAN, NAN),
        ),
    )
    return EventAnalysis(
        start=datetime(2024, 1, 1, tzinfo=UTC),
        rate=100.0,
        count=3,
        directions={"x": found, "y": replace(found, motion=None)},
        quality=(Finding("offset", "note", "an offset of 0.1 m/s² was removed", "XX.TOWER.01.HNX", 0.1),),
        peaks={"XX.TOWER.01.HNX": 0.5},
        pga=None,
        torsion=replace(MOTION, residual=ResidualDisplacement(1e-3, 1e-4)),
        axial_load=AxialLoad(np.array([1.0, 0.8, 1.3]), "slab"),
        refusal=None,
    )


def document() -> dict[str, Any]:
    event = analysed()
    return file_results(event, DESCRIPTION, AnalysisSettings(), verdict_out(of_analysis(event, DESCRIPTION, {})))


def test_the_file_has_the_schema_of_the_api_and_every_cycle() -> None:
    found = document()
    x, y = found["directions"]
    mode = x["modes"][0]
    assert mode == {
        "number": 1,
        "frequency": 1.09,
        "frequency_std": 0.002,
        "damping_ratio": 0.01,
        "damping_ratio_std": None,
        "shape": {"2F": 0.4, "roof": 1.0},
        "shape_std": None,
        "misfit": None,
    }
    assert x["assessment"] == {
        "assumption": "masses as told",
        "chi_square": 1.1,
        "is_at_rest": True,
        "prior_share": 0.2,
        "fallback": None,
    }
    assert (found["estimator"], x["peak_force"], x["force_std"], x["cycles"]) == ("smoother", 3e6, 4e4, 2)
    assert (x["peak_displacement"], x["peak_displacement_std"]) == (0.03, 2e-3)
    assert (x["lowest_frequency"], x["highest_frequency"]) == (0.12, 50.0)
    assert x["residual_displacement"] is y["peak_displacement"] is None
    layer = found["layer"]
    assert (layer["peak_torsion"], layer["peak_torsion_std"], layer["torsion_lowest_frequency"]) == (0.03, 2e-3, 0.12)
    assert (layer["axial_load_level"], layer["lowest_axial_load"], layer["highest_axial_load"]) == ("slab", 0.8, 1.3)
    first = {"direction": "x", "start": 1.0, "end": 3.0, "amplitude": 0.02, "shear_strain": 0.1}
    assert found["cycles"][0] == first | {"k_eq": 5e6, "k_eq_std": 1e5, "c_eq": 2e5, "c_eq_std": 1e4}
    assert found["estimators"] == {"x": "cms", "y": "cms"}
    assert found["quality"][0]["kind"] == "offset"
    assert found["start"] == "2024-01-01T00:00:00Z"
    assert found["verdict"]["level"] == "undecided"
    of_file = {"rate", "version", "estimator", "estimators", "settings", "refusal", "cycles", "missing"}
    assert set(found) - set(EventOut.model_fields) == of_file


def test_what_is_missing_is_null_with_its_reason() -> None:
    found = document()
    assert found["cycles"][1]["c_eq"] is None
    missing = found["missing"]
    assert missing["cycles[1].c_eq"] == "the record does not determine it"
    assert missing["cycles[1].c_eq_std"] == "the record does not determine it"
    assert missing["directions[0].modes[0].damping_ratio_std"] == "the estimator gives none"
    assert "unless" in missing["layer.peak_resultant"]
    assert "no transducer" in missing["directions[0].residual_displacement"]
    assert missing["pga"] == "no horizontal acceleration of the ground was measured"
    assert "cycles[0].c_eq" not in missing


def test_every_null_has_a_reason_and_no_nan_is_left() -> None:
    found = document()
    text = json.dumps(found, allow_nan=False)
    assert found["missing"]["shaking"] == "no horizontal acceleration was recorded"
    assert orjson.loads(orjson.dumps(found)) == json.loads(text)
    without_verdict = json.dumps({name: value for name, value in found.items() if name != "verdict"})
    assert without_verdict.count("null") == len(found["missing"])
