"""The first page, and its content security policy."""

import re
from collections import Counter
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from html import unescape

import numpy as np
import pytest
from api_client import client
from sqlalchemy.orm import Session, sessionmaker

from core.comparison.misfit import Misfit
from core.model.isolator import Isolator
from service.analyses import history
from service.analyses.tables import Analysis, CycleResult, DirectionResult, ModeResult
from service.buildings.tables import Building, Revision
from service.db import blobs
from service.http.rendering import FOLDER
from service.jobs.tables import Job
from service.models import store as model_store
from service.models.comparing import Compared
from service.models.store import Draft
from service.records.tables import Event

pytestmark = pytest.mark.sqlite

START = datetime(2011, 3, 11, 5, 46, 24, tzinfo=UTC)
TIME = np.arange(2000) / 100
BUILDING = """
code = "{code}"
name = "{name}"
[[level]]
name = "ground"
role = "ground"
[[level]]
name = "base"
role = "base"
mass = 2e5
[[level]]
name = "roof"
mass = 1e5
[isolation]
[[channel]]
id = "XX.{code}.01.HNX"
level = "base"
direction = "x"
quantity = "acceleration"
"""


def building(session: Session, code: str, name: str) -> Building:
    made = Building(code=code, name=name, created_at=START)
    toml = BUILDING.format(code=code, name=name)
    session.add(Revision(building=made, number=1, toml=toml, folder="/", created_at=START))
    session.flush()
    return made


def event(session: Session, at: Building, day: int, state: str, reason: str | None = None) -> Event:
    start = START + timedelta(days=day)
    made = Event(
        building=at, start=start, end=start, state=state, reason=reason, created_at=start, updated_at=start
    )  # fmt: skip
    session.add(made)
    session.flush()
    return made


def result(peak_displacement: float | None = 0.012, modes: int = 5, cycles: int = 2) -> DirectionResult:
    force = blobs.encode(3e6 * np.sin(TIME))
    displacement = None if peak_displacement is None else blobs.encode(peak_displacement * np.sin(TIME + 0.1))
    return DirectionResult(
        direction="x",
        start=START,
        rate=100.0,
        count=TIME.size,
        peak_force=3_294_400.0,
        force_std=340.0,
        peak_displacement=peak_displacement,
        displacement=displacement,
        velocity=displacement,
        **dict.fromkeys(("force", "force_rigid", "force_modal", "force_std_history"), force),
        modes=[
            ModeResult(number=number, frequency=1.0 * number, damping_ratio=0.02, shape={"roof": 1.0})
            for number in range(1, modes + 1)
        ],
        cycles=[
            CycleResult(start=0.0, end=1.0, amplitude=0.01, k_eq=5e8, k_eq_std=1e6, c_eq=1e6, c_eq_std=1e5)
            for _ in range(cycles)
        ],
    )


def analysed(session: Session, of: Event, result: DirectionResult | None, refusal: str | None = None) -> Analysis:
    job = Job(kind="analyse", event_id=of.id, arguments={}, state="done", created_at=START)
    session.add(job)
    session.flush()
    finding = {"kind": "gap", "severity": "warning", "message": "1 s < is missing", "channel": None, "value": None}
    made = Analysis(
        event=of,
        job_id=job.id,
        revision_id=of.building.revisions[0].id,
        current=True,
        created_at=START,
        version="1",
        settings={},
        inputs=[],
        quality=[finding],
        refusal=refusal,
        peaks={},
        pga=0.398,
        directions=[result] if result else [],
    )
    session.add(made)
    return made


@pytest.fixture
def stored(sessions: sessionmaker[Session]) -> Iterator[Session]:
    with sessions() as session:
        yield session


def read_page(url: str, session: Session, address: str = "/buildings/A") -> str:
    """A page, that of building A unless another one is named, as it reads: its times without their elements."""
    session.commit()
    with client(url) as api:
        answer = api.get(address)
    assert answer.status_code == 200
    return re.sub(r"</?time[^>]*>", "", unescape(answer.text))


def test_without_a_building_the_page_says_how_to_begin(database_url: str, stored: Session) -> None:
    assert "menshin building add FILE" in read_page(database_url, stored, "/")


def test_without_an_earthquake_the_page_says_so(database_url: str, stored: Session) -> None:
    building(stored, "A", "Tower")
    assert "No earthquake has been recorded yet." in read_page(database_url, stored, "/")
    assert "No earthquake has been recorded yet at A." in read_page(database_url, stored)


def test_the_last_event_is_shown_with_its_results(database_url: str, stored: Session) -> None:
    tower = building(stored, "A", "Tower")
    analysed(stored, event(stored, tower, 1, "analysed"), result())
    page = read_page(database_url, stored)
    for shown in (
        "Tower: last event, 2011-03-12 05:46:24 UTC",
        "39.8 gal",
        "3,294.40 ± 0.34 kN",
        "± is one standard deviation",
        "12.0 mm",
        "Fixed-base mode 3",
        "2 more modes",
        "1 s < is missing",
    ):
        assert shown in page, shown
    assert "Fixed-base mode 4" not in page


def test_times_are_those_of_the_building_with_utc_on_hover(database_url: str, stored: Session) -> None:
    tower = building(stored, "A", "Tower")
    revision = stored.query(Revision).one()
    revision.toml = 'timezone = "Asia/Tokyo"\n' + revision.toml
    last = event(stored, tower, 1, "refused", "too short")
    stored.commit()
    shown = '<time datetime="2011-03-12T05:46:24Z" title="2011-03-12 05:46:24 UTC">2011-03-12 14:46:24</time>'
    with client(database_url) as api:
        for address in ("/", "/buildings/A", "/buildings/A/events", f"/events/{last.id}"):
            assert shown in unescape(api.get(address).text), address
        assert "(Asia/Tokyo)" in api.get("/buildings/A/events").text
        assert "<title>A: earthquake of 2011-03-12 14:46:24" in api.get(f"/events/{last.id}").text


@pytest.mark.parametrize(
    ("state", "reason", "shown"),
    [
        ("refused", "the base slab is not measured", "It could not be used</strong>: the base slab is not measured"),
        ("failed", "MemoryError", "Its analysis failed</strong>: MemoryError"),
        ("queued", None, "It waits for its analysis"),
        ("gathering", None, "Its files are still coming in"),
        ("dreaming", None, "dreaming"),
    ],
)
def test_a_last_event_without_a_result_says_why_and_hides_no_result(
    database_url: str, stored: Session, state: str, reason: str | None, shown: str
) -> None:
    tower = building(stored, "A", "Tower")
    analysed(stored, event(stored, tower, 1, "analysed"), result())
    last = event(stored, tower, 2, state, reason)
    if state == "refused":
        analysed(stored, last, None, reason)
    page = read_page(database_url, stored)
    assert shown in page
    assert page.index("last event, 2011-03-13") < page.index("last event with a result, 2011-03-12")
    assert "/charts/restoring-force.svg" in page


@pytest.mark.parametrize(("error", "is_reported"), [(0.1, True), (0.001, False)])
def test_an_accepted_model_that_misses_the_latest_events_is_reported(
    database_url: str, stored: Session, error: float, is_reported: bool
) -> None:
    """It was fitted to an event that it met to 0.1 % of the force, by noise alone."""
    tower = building(stored, "A", "Tower")
    draft = Draft("x", Isolator({"elastic": {"k_b": 5e8}}), "by hand", "me", tower.revisions[0].id)
    model = model_store.add(stored, tower.id, draft, START)
    model_store.accept(stored, model, "me", START)
    for day, (role, off) in enumerate([("fitted", 0.001), ("later", error), ("later", error)]):
        analysis = analysed(stored, event(stored, tower, day, "analysed"), result())
        stored.flush()
        misfit = Misfit(TIME.size, error=off**2, signal=1.0, spread=1.0, noise=1e-6)
        held = Compared(analysis.event_id, analysis.id, "x", np.zeros(TIME.size), misfit, None, {})
        model_store.add_comparisons(stored, model.id, [held], {analysis.event_id: role}, START)
    page = read_page(database_url, stored)
    assert (
        f'<a href="/models/{model.id}">Model x 1</a> of A: The model misses the latest 2 events' in page
    ) == is_reported


def test_the_only_event_was_refused(database_url: str, stored: Session) -> None:
    tower = building(stored, "A", "Tower")
    analysed(stored, event(stored, tower, 1, "refused", "no ground"), None, "no ground")
    page = read_page(database_url, stored)
    assert "no ground" in page
    assert "with a result" not in page


def test_each_building_has_its_page_and_names_are_escaped(database_url: str, stored: Session) -> None:
    for day, (code, name) in enumerate([("A", "Tower"), ("B", "Hall"), ("C", "School")]):
        event(stored, building(stored, code, name), 10 - day, "queued")
    building(stored, "D", "<b>New</b>")
    assert "Tower: last event" in read_page(database_url, stored)
    with client(database_url) as api:
        for page in ("/", "/buildings/D"):
            assert "<b>New" not in api.get(page).text
        assert api.get("/?building=B").headers["location"] == "/buildings/B"
        assert api.get("/buildings/E").status_code == 404


def test_what_was_not_measured_is_no_picture(database_url: str, stored: Session) -> None:
    tower = building(stored, "A", "Tower")
    analysed(stored, event(stored, tower, 1, "analysed"), result(peak_displacement=None))
    page = read_page(database_url, stored)
    assert "not measured" in page
    assert set(re.findall(r"/charts/([\w-]+)", page)) == {"force-parts"}, "force is known from the accelerations"


def test_every_picture_is_drawn_and_has_its_data_beside_it(database_url: str, stored: Session) -> None:
    tower = building(stored, "A", "Tower")
    analysed(stored, event(stored, tower, 1, "analysed"), result())
    figures = re.findall(r"<figure class=.chart.*?</figure>", read_page(database_url, stored), re.DOTALL)
    assert {"restoring-force", "force-parts", "cycles"} <= set(re.findall(r"src=./charts/([\w-]+)", "".join(figures)))
    with client(database_url) as api:
        for figure in figures:
            picture, table, *data = re.findall(r'(?:src|href)="([^"]*)"', figure)
            assert "<caption>" in api.get(table).text
            assert api.get(picture).headers["content-type"] == "image/svg+xml"
            assert [api.get(one).headers["content-type"][:8] for one in data] == ["text/csv"] * len(data)
            csv = api.get(picture.replace(".svg", ".csv"))
            assert csv.headers["content-type"].startswith("text/csv")


def test_of_too_many_cycles_the_latest_are_drawn(stored: Session) -> None:
    tower = building(stored, "A", "Tower")
    for day, cycles in ((1, 3), (3, 2), (2, 4)):
        analysed(stored, event(stored, tower, day, "analysed"), result(cycles=cycles))
    stored.flush()
    days = [(row.event_start - START).days for row in history.latest_cycles(stored, tower.id, "x", 5)]
    assert days == [2, 2, 2, 3, 3]


def test_a_browser_loads_nothing_from_elsewhere_and_runs_no_script_but_that_of_the_forms(
    database_url: str, stored: Session
) -> None:
    tower = building(stored, "A", "Tower")
    analysed(stored, event(stored, tower, 1, "analysed"), result())
    stored.commit()
    with client(database_url) as api:
        for path in ("/", "/docs", "/login"):
            answer = api.get(path)
            policy = dict(part.strip().split(" ", 1) for part in answer.headers["content-security-policy"].split(";"))
            assert policy["default-src"] == policy["frame-ancestors"] == "'none'"
            assert not re.search(r'(?:src|href|action)="(?!/(?!/)|#)', answer.text), path
            assert not re.search(
                r"<script(?! src=./static/[\w/.-]+\.js.[^<>]*></script>)|\son\w+=|javascript:|style=", answer.text
            ), path
            icon = re.search(r'rel="icon" href="([^"]*)"', answer.text)
            assert icon is not None
            assert api.get(icon[1]).status_code == 200


def test_scripts_have_no_global_name_in_common() -> None:
    """They share one page: a second function of a name would replace the first."""
    names = [
        name
        for script in (FOLDER / "static").glob("*.js")
        for name in set(
            re.findall(r"^(?:async )?(?:function\*?|const|let|class) (\w+)", script.read_text(), re.MULTILINE)
        )
    ]
    assert sorted(name for name, count in Counter(names).items() if count > 1) == []
