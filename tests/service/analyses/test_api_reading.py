"""API responses for a building in use, on both databases, with data that arrived as records do."""

import csv
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import monitored_building
import numpy as np
import pytest
from api_server import api_server
from sqlalchemy.orm import Session, sessionmaker

from service.db.blobs import ROUNDING

pytestmark = pytest.mark.slow

API = "/api/v1"
PAPER = f"{API}/buildings/PAPER"
FORCE = f"{API}/events/3/restoring-force"
SERIES = (
    "displacement",
    "displacement_std",
    "velocity",
    "velocity_std",
    "force",
    "force_rigid",
    "force_modal",
    "force_std",
)


@pytest.fixture
def api(database_url: str, sessions: sessionmaker[Session], tmp_path: Path) -> Iterator[httpx.Client]:
    (tmp_path / "records").mkdir()
    monitored_building.watch(sessions, tmp_path / "records")
    with api_server(database_url) as address, httpx.Client(base_url=address, timeout=30) as client:
        yield client


def answer(api: httpx.Client, path: str, **parameters: object) -> Any:  # noqa: ANN401  JSON
    found = api.get(path, params=parameters)
    assert found.status_code == 200, found.text
    return found.json()


def rows(api: httpx.Client, path: str, **parameters: object) -> list[dict[str, str]]:
    found = api.get(path, params=parameters, headers={"Accept": "text/csv"})
    assert found.headers["content-type"].startswith("text/csv")
    return list(csv.DictReader(io.StringIO(found.text)))


def test_everything_of_a_building_is_answered(api: httpx.Client) -> None:
    """One service for all questions: setting it up takes longer than asking."""
    lists(api)
    events(api)
    one_event(api)
    over_the_years(api)
    force(api)
    waveform(api)
    tags(api)
    problems(api)


def lists(api: httpx.Client) -> None:
    (building,) = answer(api, f"{API}/buildings")["items"]
    assert (building["code"], building["events"], building["last_event"]) == ("PAPER", 4, "2024-06-03T06:07:08Z")
    described = answer(api, PAPER)
    assert [level["role"] for level in described["levels"]] == ["ground", "base", *["floor"] * 7]
    assert described["rubber_height"] == 0.2
    assert {channel["id"] for channel in described["channels"]} >= {monitored_building.BASE}
    (source,) = answer(api, f"{API}/sources")["items"]
    assert (source["kind"], source["failing_since"], source["error"]) == ("folder", None, None)
    assert source["succeeded_at"].endswith("Z")
    jobs = answer(api, f"{API}/jobs")["items"]
    assert [(job["kind"], job["state"]) for job in jobs] == [("watch", "done"), *[("analyse", "done")] * 4]
    assert [job["building_id"] for job in jobs] == [1, None, None, None, None]
    assert answer(api, f"{API}/jobs/{jobs[0]['id']}") == jobs[0]
    assert answer(api, f"{API}/jobs", event=2)["items"] == [job for job in jobs if job["event_id"] == 2]


def events(api: httpx.Client) -> None:
    every = answer(api, f"{PAPER}/events")["items"]
    assert [event["id"] for event in every] == [4, 3, 2, 1]
    assert [event["state"] for event in every] == ["refused", "analysed", "analysed", "analysed"]
    assert "the base slab" in every[0]["reason"]
    pages, cursor = [], None
    while True:
        page = answer(api, f"{PAPER}/events", limit=1, **({} if cursor is None else {"cursor": cursor}))
        pages += page["items"]
        cursor = page["next"]
        if cursor is None:
            break
    assert pages == every
    second = monitored_building.start(1).isoformat()
    assert [e["id"] for e in answer(api, f"{PAPER}/events", after=second)["items"]] == [4, 3, 2]
    assert [e["id"] for e in answer(api, f"{PAPER}/events", before=second)["items"]] == [1]
    assert [e["id"] for e in answer(api, f"{PAPER}/events", min_pga=0.3)["items"]] == [3, 2]
    assert [row["id"] for row in rows(api, f"{PAPER}/events")] == ["4", "3", "2", "1"]


def one_event(api: httpx.Client) -> None:
    event = answer(api, f"{API}/events/3")
    (x,) = event["directions"]
    assert x["modes"][0]["frequency"] == pytest.approx(1.09, rel=5e-3)  # paper, Table I
    assert x["cycles"] == len(answer(api, f"{PAPER}/equivalent", after=event["start"])["items"])
    assert event["pga"] == max(p["peak"] for p in event["peaks"] if p["level"] == "ground")
    assert len(event["analysis"]["inputs"][0]) == 64
    assert event["analysis"]["estimator"] == "smoother"
    assert x["assessment"]["fallback"] is None
    assert x["assessment"]["chi_square"] == pytest.approx(1.0, abs=0.3)  # a simulated superstructure leaves but noise
    assert event["waveforms"][0]["rate"] == 100.0
    refused = answer(api, f"{API}/events/4")
    assert refused["directions"] == []
    assert refused["analysis"]["refusal"] == refused["reason"]
    assert "fatal" in {finding["severity"] for finding in refused["quality"]}


def over_the_years(api: httpx.Client) -> None:
    for path in (f"{PAPER}/equivalent", f"{PAPER}/modes"):
        whole = answer(api, path)["items"]
        assert {row["event"] for row in whole} == {1, 2, 3}
        assert answer(api, path, direction="y")["items"] == []
        pages, cursor = [], None
        while cursor is not None or not pages:
            page = answer(api, path, limit=7, **({} if cursor is None else {"cursor": cursor}))
            pages += page["items"]
            cursor = page["next"]
        assert pages == whole
        lines = rows(api, path)
        assert [float(line["event"]) for line in lines] == [row["event"] for row in whole]
        assert list(lines[0]) == list(whole[0])
    cycles = answer(api, f"{PAPER}/equivalent")["items"]
    assert all(c["shear_strain"] == pytest.approx(c["amplitude"] / 0.2) for c in cycles)


def force(api: httpx.Client) -> None:
    whole = answer(api, FORCE, direction="x")
    assert whole["time"] is None
    assert all(len(whole[name]) == whole["count"] == 18_000 for name in SERIES)
    force, rigid, modal = (np.array(whole[name]) for name in ("force", "force_rigid", "force_modal"))
    rounding = 3 * ROUNDING * min(whole["force_std"])  # of each of the three
    np.testing.assert_allclose(force, rigid + modal, rtol=0, atol=rounding * (1 + 1e-3))  # the deviation is rounded too
    lines = rows(api, FORCE, direction="x")
    for name in SERIES:
        assert [float(line[name]) for line in lines] == whole[name], name
    thin = answer(api, FORCE, direction="x", points=500)
    assert len(thin["time"]) <= 500
    assert thin["count"] == 18_000
    for name in SERIES:
        assert (max(thin[name]), min(thin[name])) == (max(whole[name]), min(whole[name]))
    places = np.rint(np.array(thin["time"]) / thin["step"]).astype(int)
    assert thin["force"] == [whole["force"][place] for place in places]
    assert set(SERIES) & set(answer(api, FORCE, direction="x", series="force")) == {"force"}
    event = answer(api, f"{API}/events/3")
    assert event["directions"][0]["peak_force"] == pytest.approx(abs(force).max(), rel=0, abs=rounding)


def waveform(api: httpx.Client) -> None:
    path = f"{API}/events/3/waveforms/{monitored_building.BASE}"
    found = answer(api, path)
    (piece,) = found["pieces"]
    assert (found["level"], found["quantity"], piece["start"]) == ("1F", "acceleration", "2024-05-04T06:07:08Z")
    samples = [float(line["samples"]) for line in rows(api, path)]
    assert samples == piece["samples"]
    thin = answer(api, path, points=100)["pieces"][0]
    assert len(thin["samples"]) == len(thin["time"]) <= 100
    assert (max(thin["samples"]), min(thin["samples"])) == (max(samples), min(samples))


def tags(api: httpx.Client) -> None:
    for path in (f"{API}/buildings", PAPER, f"{API}/events/3", f"{FORCE}?direction=x", f"{PAPER}/equivalent"):
        etag = api.get(path).headers["ETag"]
        again = api.get(path, headers={"If-None-Match": etag})
        assert (again.status_code, again.content, again.headers["ETag"]) == (304, b"", etag)
        assert api.get(path, headers={"If-None-Match": '"old"'}).status_code == 200


def problems(api: httpx.Client) -> None:
    of_another = answer(api, f"{PAPER}/events")["items"][-1]["analysis"]
    wrong = {
        f"{API}/buildings/NONE": 404,
        f"{API}/events/99": 404,
        f"{API}/events/3?analysis={of_another}": 404,
        f"{API}/jobs/99": 404,
        f"{FORCE}?direction=y": 404,
        f"{API}/events/4/restoring-force?direction=x": 404,
        f"{API}/events/3/waveforms/XX.NO.00.HNX": 404,
        f"{API}/nothing": 404,
        f"{API}/events/None": 404,
        f"{API}/events/0/restoring-force?direction=x": 404,
        f"{FORCE}?direction=up": 422,
        FORCE: 422,
        f"{PAPER}/events?after=yesterday": 422,
        f"{PAPER}/events?min_pga=nan": 422,
        f"{PAPER}/events?cursor=x": 422,
    }
    for path, status in wrong.items():
        found = api.get(path)
        assert (found.status_code, found.headers["content-type"]) == (status, "application/problem+json"), path
        assert found.json()["detail"]
    refused = api.delete(PAPER)
    assert (refused.status_code, refused.json()["status"], refused.headers["Allow"]) == (405, 405, "GET")
    assert api.delete(f"{PAPER}/models").headers["Allow"] == "GET, POST"
