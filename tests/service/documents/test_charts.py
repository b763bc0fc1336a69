import json
import re
from datetime import UTC, datetime, timedelta

import altair as alt
import numpy as np
import pytest
import vl_convert

from core.isolation_layer.equivalent import EquivalentSegment
from service.documents import charts as report_charts, live, still
from service.documents.translated import translated
from service.language.choice import speaking

RATE = 100.0
TIME = np.arange(18_000) / RATE
DISPLACEMENT = 0.08 * np.sin(2 * np.pi * 0.35 * TIME) * np.exp(-(((TIME - 60) / 40) ** 2))
FORCE = 4e6 * DISPLACEMENT + 3e5 * np.tanh(20 * np.gradient(DISPLACEMENT, TIME))
STD = np.full(TIME.size, 2e4)
START = datetime(2024, 1, 1, tzinfo=UTC)


def cycles(events: int) -> dict[datetime, list[EquivalentSegment]]:
    return {
        START + timedelta(days=day): [EquivalentSegment(0.0, 2.0, a, None, 5e6, 1e5, 2e5, 1e4) for a in (0.005, 0.05)]
        for day in range(events)
    }


PICTURES = {
    "restoring force": report_charts.restoring_force(
        time=TIME, displacement=DISPLACEMENT, force=FORCE, std=STD, title="T"
    ),
    "loop": report_charts.loop(time=TIME, displacement=DISPLACEMENT, force=FORCE, title="T"),
    "force history": report_charts.force_history(time=TIME, force=FORCE, std=STD),
    "orbit": report_charts.orbit(TIME, DISPLACEMENT, 0.5 * np.roll(DISPLACEMENT, 70)),
    "torsion": report_charts.torsion_history(TIME, 0.02 * DISPLACEMENT, np.full(TIME.size, 1e-5)),
    "axial load": report_charts.axial_load_history(TIME, 1 + DISPLACEMENT),
    "k_eq": report_charts.equivalent_stiffness(cycles(3), "T"),
    "c_eq": report_charts.equivalent_damping(cycles(3), "T"),
    "k_eq over years": report_charts.equivalent_stiffness(cycles(40), "T"),
}


def titles(picture: alt.LayerChart | alt.VConcatChart) -> set[str]:
    """Titles of all axes."""
    found: set[str] = set()

    def walk(value: object) -> None:
        if isinstance(value, dict):
            for name, channel in value.get("encoding", {}).items():
                if name in ("x", "y") and "title" in channel:
                    found.add(channel["title"])
            for member in value.values():
                walk(member)
        elif isinstance(value, list):
            for member in value:
                walk(member)

    walk(picture.to_dict())
    return found


@pytest.mark.parametrize("name", PICTURES)
def test_every_axis_has_a_unit(name: str) -> None:
    assert titles(PICTURES[name])
    for title in titles(PICTURES[name]):
        assert title.endswith(("(s)", "(mm)", "(mrad)", "(kN)", "(kN/mm)", "(kN s/mm)", "(N/W)")), title


@pytest.mark.parametrize("name", PICTURES)
def test_every_picture_is_drawn_without_a_browser_or_a_network(name: str) -> None:
    svg = vl_convert.vegalite_to_svg(PICTURES[name].to_dict(), allowed_base_urls=[])
    assert svg.startswith("<svg")
    assert "NaN" not in svg


@pytest.mark.parametrize("name", PICTURES)
def test_a_picture_is_small_enough_for_a_page(name: str) -> None:
    """18,000 samples as they are would make two megabytes."""
    assert len(json.dumps(PICTURES[name].to_dict())) < 8e5


def test_values_are_in_the_units_of_the_axes() -> None:
    (rows,) = PICTURES["k_eq"].to_dict()["datasets"].values()
    assert rows[1]["amplitude"] == 50.0
    assert rows[1]["k_eq"] == 5.0
    assert (rows[1]["k_eq_low"], rows[1]["k_eq_high"]) == pytest.approx((4.9, 5.1))
    assert rows[1]["c_eq"] == pytest.approx(0.2)


def test_a_few_events_are_named_and_many_are_ordered_in_time() -> None:
    def colour(name: str) -> str:
        return PICTURES[name].to_dict()["layer"][1]["encoding"]["color"]["type"]

    assert (colour("k_eq"), colour("k_eq over years")) == ("nominal", "quantitative")


@pytest.mark.parametrize(
    ("days", "shown"),
    [
        (1, ["2024-01-01", "2024-01-20", "2024-02-09"]),
        (30, ["2024", "2025", "2026", "2027"]),
        (300, ["2024", "2028", "2032", "2036", "2040", "2044", "2048", "2052", "2056"]),
    ],
)
def test_the_legend_of_many_events_shows_days_or_years(days: int, shown: list[str]) -> None:
    cycle = [EquivalentSegment(0.0, 2.0, 0.01, None, 5e6, 1e5, 2e5, 1e4)]
    events = {START + timedelta(days=days * number): cycle for number in range(40)}
    svg = vl_convert.vegalite_to_svg(report_charts.equivalent_stiffness(events, "T").to_dict())
    found = [label for label in re.findall(r"<text[^>]*>([^<]*)</text>", svg) if re.fullmatch(r"20\d\d(-.*)?", label)]
    assert found == shown


def test_an_axis_gets_its_own_settings_while_another_thread_makes_one() -> None:
    mine, theirs = alt.X("mine:Q").scale, alt.X("theirs:Q").scale  # both looked up before either is called

    assert mine(type="log").to_dict(context={})["field"] == "mine"
    assert theirs(type="log").to_dict(context={})["field"] == "theirs"


def test_a_chart_is_shown_in_the_language_of_its_reader_and_its_data_stay() -> None:
    chart = PICTURES["force history"]
    spec = report_charts.specification(lambda: chart)
    assert translated(spec) is spec
    with speaking("ja"):
        shown, drawn = translated(live.live(spec)), still.svg(spec)
        tables = live.tables(spec)
    assert "labelExpr" in json.dumps(shown)
    assert shown["usermeta"]["embedOptions"]["timeFormatLocale"]["months"][0] == "1月"
    for japanese in ("推定値", "±2 標準偏差", "記録開始からの時間 (s)", "力 (kN)"):
        assert japanese in drawn
    assert re.findall(r">([^<]*[a-z]{4,}[^<]*)</text>", drawn) == []
    assert tables[0][1].columns[0] == "時間 (s)"
    assert live.as_csv(spec).startswith(b"time (s)")
