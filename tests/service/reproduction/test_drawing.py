import re

import altair as alt
import numpy as np
import vl_convert

from service.reproduction.drawing import Curve, exact, histories, loops, profiles, strongest

TURNS = np.linspace(0, 8 * np.pi, 4000)


def longest_lines(panel: alt.LayerChart) -> list[np.ndarray]:
    """(points, 2) pixels of every drawn line of more than ten points."""
    paths = re.findall(r' d="(M[^"]+)"', vl_convert.vegalite_to_svg(panel.to_dict()))
    lines = [np.array(re.findall(r"(-?[\d.]+),(-?[\d.]+)", path), dtype=float) for path in paths]
    return [line for line in lines if len(line) > 10]


def test_a_loop_is_drawn_in_the_order_of_time() -> None:
    """A spiral of four turns: no chord is longer than two of its thinning's steps (1/60 of 380 pixels) on each axis."""
    growing = TURNS / TURNS[-1]
    panel = loops(growing * np.cos(TURNS), [Curve("a", growing * np.sin(TURNS))])
    (line,) = longest_lines(panel)
    assert len(line) > 200
    assert np.abs(np.diff(line, axis=0)).max() < 2 * 380 / 60


def test_a_history_keeps_its_peaks_and_the_exact_curve_comes_first() -> None:
    """A spike of one sample in 4000 reaches the top of the panel."""
    values = np.zeros(4000)
    values[1234] = 1.0
    curves = [exact(values), Curve("estimated", values)]
    lines = longest_lines(histories(np.arange(4000.0), curves, "force (kN)"))
    assert len(lines) == 2
    assert all(line[:, 1].max() - line[:, 1].min() > 100 for line in lines)
    panel = histories(np.arange(4000.0), curves, "force (kN)").to_dict()
    assert [layer["transform"][0]["calculate"] for layer in panel["layer"]] == ['"exact"', '"estimated"']


def test_names_of_levels_stand_at_the_axis_and_sensors_are_marked() -> None:
    shape = Curve("expanded", np.array([0.0, 0.4, 1.0]))
    svg = vl_convert.vegalite_to_svg(profiles(["1F", "it's 2F", "RF"], [shape], [1, 2], "mode 1").to_dict())
    assert all(f">{name}<" in svg for name in ("1F", "it's 2F", "RF"))
    assert len(re.findall(r'aria-roledescription="point"', svg)) == 2


def test_the_strongest_window_holds_the_burst() -> None:
    quiet = np.full(1000, 0.1)
    quiet[600:650] = np.cos(np.arange(50))
    window = strongest(quiet, 10.0, 10.0)
    assert window.stop - window.start == 100
    assert window.start <= 600 < 650 <= window.stop
    assert strongest(quiet, 10.0, 1000.0) == slice(0, 1000)
