"""An event whose analysis was rejected: no model is compared with it, but it gives evidence on the sensors."""

from collections.abc import Sequence
from datetime import timedelta
from pathlib import Path

import monitored_building
import numpy as np
import paper_records
import pytest
from sqlalchemy.orm import Session, sessionmaker

from core.diagnosis.building_faults import building_faults
from core.diagnosis.sensor_faults import Cause
from core.paper import ISOLATOR
from core.workbench.earthquakes import Earthquakes, unusable
from service.jobs import queue as job_queue
from service.jobs.stages import silent
from service.kinds import KINDS
from service.models import jobs as model_jobs, requests as model_requests
from service.models.comparing import records
from service.models.inputs import WorkInputs
from service.models.schema import FitRequest, ModelRequest

pytestmark = pytest.mark.sqlite

EFFECTS = {name: dict(values) for name, values in ISOLATOR.effects.items()}


def dead_base(number: int) -> bytes:
    samples = paper_records.records(np.random.default_rng(number), 0.3)
    samples[monitored_building.BASE] = np.zeros_like(samples[monitored_building.BASE])
    return paper_records.miniseed(samples, later=number * monitored_building.APART)


@pytest.fixture
def building(sessions: sessionmaker[Session], tmp_path: Path) -> sessionmaker[Session]:
    """It has had two earthquakes; in the second the base slab's sensor was dead."""
    (tmp_path / "records").mkdir()
    monitored_building.watch(sessions, tmp_path / "records", [monitored_building.earthquakes()[1], dead_base(2)])
    return sessions


def requested(sessions: sessionmaker[Session], events: Sequence[int] | None) -> tuple[WorkInputs, Earthquakes]:
    """Input of a diagnosis, up to the search for a missing effect."""
    with sessions.begin() as session:
        model = model_requests.make(
            session, "PAPER", ModelRequest(direction="x", effects=EFFECTS), "engineer", monitored_building.NOW
        )
        model_requests.diagnose(
            session,
            model.id,
            FitRequest(events=None if events is None else list(events)),
            "engineer",
            monitored_building.NOW,
        )
    with sessions.begin() as session:
        claim = job_queue.claim(session, monitored_building.NOW, timedelta(minutes=1))
        assert claim is not None
        inputs = KINDS[job_queue.DIAGNOSE].inputs(session, claim, monitored_building.SETTINGS).of_kind
    *reading, _ = model_jobs.diagnosis_stages(inputs)
    return inputs, records(inputs, [stage.function(*stage.arguments((), silent)) for stage in reading])


def test_its_sensors_are_requested_and_nothing_is_fitted_to_it(building: sessionmaker[Session]) -> None:
    inputs, seen = requested(building, None)
    assert [one.event.event_id for one in inputs.events] == [1]
    assert [one.name for one in seen.fitted] == [inputs.events[0].event.name]
    assert len(seen.analyses) == 2
    (why,) = seen.unused
    assert why.startswith(f"{inputs.unusable[0].event.name}: {monitored_building.BASE}")
    (suspect,) = building_faults(seen.analyses, seen.description)
    assert (suspect.cause, suspect.kind, suspect.channel) == (Cause.SENSOR, "dead", monitored_building.BASE)
    assert "in 1 of 2 earthquakes" in suspect.message


def test_of_events_that_are_named_only_these_are_requested(building: sessionmaker[Session]) -> None:
    inputs, seen = requested(building, [1])
    assert (inputs.unusable, len(seen.analyses), seen.unused) == ((), 1, ())
    assert building_faults(seen.analyses, seen.description) == ()


def test_a_direction_that_nothing_is_known_of_is_reported(building: sessionmaker[Session]) -> None:
    _, seen = requested(building, [1])
    (analysis,) = seen.analyses
    assert unusable(analysis, ["x"], ["x"]) is None
    assert unusable(analysis, ["x"], ["x", "y"]) == "neither force nor motion of the layer is known in direction y"
