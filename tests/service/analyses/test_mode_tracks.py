"""Modes over events: the API, the page and its picture."""

import re
from datetime import UTC, datetime, timedelta
from html import unescape
from typing import Any

import numpy as np
import pytest
from api_client import client
from sqlalchemy.orm import Session, sessionmaker

from core.building import fixed_base_modes
from core.paper import BUILDING
from service.analyses.tables import Analysis, DirectionResult, ModeResult
from service.buildings.tables import Building, Revision
from service.db import blobs
from service.jobs.tables import Job
from service.records.tables import Event

pytestmark = pytest.mark.sqlite

START = datetime(2021, 1, 1, tzinfo=UTC)
EVENTS = 12
EXACT = fixed_base_modes(BUILDING)
LEVELS = ("2F", "3F", "4F", "5F", "6F", "7F", "RF")
TRACKS = "/api/v1/buildings/T/mode-tracks"


def mode(number: int, softening: float, rng: np.random.Generator) -> ModeResult:
    shape = EXACT.shape[:, number] / EXACT.shape[-1, number] + 0.02 * rng.standard_normal(7)
    frequency = EXACT.frequency[number] * (1 - softening) * (1 + 0.002 * rng.standard_normal())
    return ModeResult(
        number=number + 1,
        frequency=frequency,
        frequency_std=0.002 * frequency,
        damping_ratio=EXACT.damping_ratio[number] * (1 + 0.05 * rng.standard_normal()),
        damping_ratio_std=0.05 * EXACT.damping_ratio[number],
        shape=dict(zip(LEVELS, shape.tolist(), strict=True)),
        shape_std=dict.fromkeys(LEVELS, 0.02),
        misfit=1.1,
    )


def spurious() -> ModeResult:
    return ModeResult(number=9, frequency=12.0, damping_ratio=0.01, shape=dict.fromkeys(LEVELS, 1.0))


def happened(session: Session, building: Building, number: int) -> None:
    """An event each three months; the strength of the shaking goes up and down, and frequencies with it."""
    rng = np.random.default_rng(number)
    strength = 0.5 * (1 + np.sin(number))
    start = START + timedelta(days=90 * number)
    event = Event(
        building=building, start=start, end=start, state="analysed", created_at=start, updated_at=start
    )  # fmt: skip
    session.add(event)
    session.flush()
    job = Job(kind="analyse", event_id=event.id, arguments={}, state="done", created_at=start)
    session.add(job)
    session.flush()
    blob = blobs.encode(np.zeros(4))
    kept = [one for one in range(3) if (number, one) != (4, 1)]  # one mode is missing once
    result = DirectionResult(
        direction="x",
        start=start,
        rate=100.0,
        count=4,
        peak_force=1e6 * (0.1 + strength),
        force_std=1e3,
        peak_displacement=0.001 + 0.02 * strength,
        **dict.fromkeys(("force", "force_rigid", "force_modal", "force_std_history"), blob),
        modes=[mode(one, 0.03 * strength, rng) for one in kept] + [spurious()] * (number == 7),
    )
    common: dict[str, Any] = {"current": True, "created_at": start, "version": "1", "settings": {}, "inputs": []}
    revision = building.revisions[0].id
    session.add(
        Analysis(event=event, job_id=job.id, revision_id=revision, quality=[], peaks={}, directions=[result], **common)
    )


@pytest.fixture
def watched(database_url: str, sessions: sessionmaker[Session]) -> str:
    """The database of a building after three years."""
    with sessions.begin() as session:
        building = Building(code="T", name="Tower", created_at=START)
        session.add(Revision(building=building, number=1, toml="", folder="/", created_at=START))
        session.add(Building(code="NEW", name="New", created_at=START, revisions=[
            Revision(number=1, toml="", folder="/", created_at=START)
        ]))  # fmt: skip
        session.flush()
        for number in range(EVENTS):
            happened(session, building, number)
    return database_url


def test_each_mode_is_one_track_over_all_events(watched: str) -> None:
    with client(watched) as api:
        tracks = api.get(TRACKS).json()["items"]
        assert [track["established"] for track in tracks] == [True, True, True, False]
        assert [len(track["events"]) for track in tracks] == [EVENTS, EVENTS - 1, EVENTS, 1]
        # they fall by up to 3 % with the shaking
        assert [track["frequency"] for track in tracks[:3]] == pytest.approx(EXACT.frequency[:3], rel=0.03)
        first = tracks[0]["events"][0]
        assert first["event_start"] == "2021-01-01T00:00:00Z"
        assert first["peak_force"] == pytest.approx(0.6e6)
        assert list(first["shape"]) == list(first["shape_std"]) == list(LEVELS)
        assert first["misfit"] == 1.1
        assert tracks[3]["events"][0]["shape_std"] is None
        assert api.get(TRACKS, params={"direction": "y"}).json()["items"] == []
        late = api.get(TRACKS, params={"after": "2022-06-01"}).json()["items"]
        assert 0 < len(late[0]["events"]) < EVENTS
        assert api.get("/api/v1/buildings/NOBODY/mode-tracks").status_code == 404


def test_events_before_a_level_was_added_are_omitted(watched: str, sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        for one in session.query(ModeResult).join(DirectionResult).filter(DirectionResult.start < START + timedelta(1)):
            one.shape = {"2F": 0.1, "RF": 1.0}
            one.shape_std = None
    with client(watched) as api:
        assert len(api.get(TRACKS).json()["items"][0]["events"]) == EVENTS - 1


def test_the_page_lists_the_modes_of_the_building(watched: str) -> None:
    with client(watched) as api:
        page = unescape(api.get("/modes", params={"building": "T"}).text)
        assert "Tower: modes of the superstructure over the events" in page
        assert "11 of 12" in page
        assert "12 Hz" not in page
        assert "Direction y" not in page
        assert api.get("/modes", params={"building": "NOBODY"}).status_code == 404
        (picture,) = re.findall(r'<img src="(/charts/[^"]+)"', page)
        drawn = api.get(picture)
        assert drawn.headers["content-type"] == "image/svg+xml"
        for written in ("frequency (Hz)", "damping ratio (%)", "peak restoring force (kN)", "event (UTC)"):
            assert drawn.text.count(written) >= 3  # a panel for each of three modes
        assert api.get(picture, headers={"If-None-Match": drawn.headers["etag"]}).status_code == 304


def test_a_building_without_events_has_no_modes(watched: str) -> None:
    with client(watched) as api:
        assert api.get("/api/v1/buildings/NEW/mode-tracks").json()["items"] == []
        assert api.get("/modes", params={"building": "NEW"}).status_code == 200
        assert api.get("/charts/modes.svg", params={"building": "NEW", "direction": "x"}).status_code == 404
