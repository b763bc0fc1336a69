import json
from dataclasses import replace
from datetime import UTC, datetime

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
from service.analyses.report.document import as_json
from service.buildings.description import read

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


def test_the_document_has_what_the_command_promises() -> None:
    document = as_json(analysed(), DESCRIPTION, AnalysisSettings())
    x = document["directions"]["x"]
    (mode,) = x["superstructure"]["modes"]
    assert mode == {
        "frequency": 1.09,
        "frequency_std": 0.002,
        "damping_ratio": 0.01,
        "damping_ratio_std": None,
        "shape": {"2F": 0.4, "roof": 1.0},
        "shape_std": None,
        "misfit": None,
    }
    force = x["restoring_force"]
    assert force["reliance"] == {
        "assumption": "masses as told",
        "chi_square": 1.1,
        "is_at_rest": True,
        "prior_share": 0.2,
        "fallback": None,
    }
    assert (force["estimator"], force["peak"], force["std"]) == ("cms", 3e6, 4e4)
    source = "integrated from accelerations"
    assert x["motion"] == {"peak": 0.03, "peak_std": 2e-3, "source": source, "band": [0.12, 50.0], "residual": None}
    assert document["directions"]["y"]["motion"] is None
    assert document["torsion"] == x["motion"] | {"residual": {"value": 1e-3, "std": 1e-4}}
    assert document["axial_load"] == {"level": "slab", "lowest": 0.8, "highest": 1.3}
    first = {"start": 1.0, "end": 3.0, "amplitude": 0.02, "shear_strain": 0.1}
    assert x["equivalent"][0] == first | {"k_eq": 5e6, "k_eq_std": 1e5, "c_eq": 2e5, "c_eq_std": 1e4}
    assert document["quality"][0]["kind"] == "offset"
    assert document["start"] == "2024-01-01T00:00:00+00:00"


def test_what_is_missing_is_null_with_its_reason() -> None:
    document = as_json(analysed(), DESCRIPTION, AnalysisSettings())
    assert document["directions"]["x"]["equivalent"][1]["c_eq"] is None
    missing = document["missing"]
    assert missing["directions.x.equivalent[1].c_eq"] == "the record does not determine it"
    assert missing["directions.x.equivalent[1].c_eq_std"] == "the record does not determine it"
    assert missing["directions.x.superstructure.modes[0].damping_ratio_std"] == "the estimator gives none"
    assert "unless" in missing["peak_resultant"]
    assert "no transducer" in missing["directions.x.motion.residual"]
    assert missing["pga"] == "no horizontal acceleration of the ground was measured"
    assert "directions.x.equivalent[0].c_eq" not in missing


def test_every_null_has_a_reason_and_no_nan_is_left() -> None:
    document = as_json(analysed(), DESCRIPTION, AnalysisSettings())
    text = json.dumps(document, allow_nan=False)
    assert orjson.loads(orjson.dumps(document)) == json.loads(text)
    assert text.count("null") == len(document["missing"])
