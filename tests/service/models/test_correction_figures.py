"""Axes of the corrections: a distant point is named at the edge instead of flattening the others."""

import numpy as np
import pytest
import vl_convert

from core.comparison.block_corrections import BlockCorrection
from service.documents.document import Figure
from service.models.figures.corrections import robust_range, stiffness_over_amplitude, yield_over_travel

STD = 0.5e6
"""N/m."""


def block(number: int, stiffness: float, earthquake: str = "2024-01-01 09:00:00") -> BlockCorrection:
    """A block's correction (N/m); the yield correction in N is a hundredth of it."""
    amplitude = 0.01 * 1.1**number
    return BlockCorrection(earthquake, "x", 5.0 * number, amplitude, number, stiffness, STD, stiffness / 100, STD / 100)


def scattered(*distant: float, count: int = 30) -> list[BlockCorrection]:
    """Corrections of ± 5 kN/mm, and these (kN/mm)."""
    near = np.linspace(-5e6, 5e6, count)
    return [block(n, k) for n, k in enumerate([*near, *(1e6 * one for one in distant)])]


def drawn(figure: Figure | None) -> str:
    assert figure is not None
    return vl_convert.vegalite_to_svg(figure.pictures[0].to_dict())


def heights(figure: Figure | None) -> list[float]:
    """Values of the points as drawn."""
    assert figure is not None
    spec = figure.pictures[0].to_dict()
    return [row["y"] for layer in spec["layer"][2:] for row in spec["datasets"][layer["data"]["name"]]]


def test_a_distant_point_is_at_the_edge_and_named_in_chart_caption_and_table() -> None:
    figure = stiffness_over_amplitude(scattered(-870.0))
    assert figure is not None
    assert -25 < min(heights(figure)) < -15
    remark = "1 of 31 points lies outside the axis, a triangle at its edge: at −870 kN/mm."
    assert remark in figure.caption
    assert remark in drawn(figure)
    assert figure.numbers is not None
    at = figure.numbers.columns.index("on the axis")
    assert [row[at] for row in figure.numbers.rows] == ["yes"] * 30 + ["no"]
    assert figure.numbers.rows[-1][2] == "−870"


def test_several_distant_points_are_counted_at_both_edges() -> None:
    figure = yield_over_travel(scattered(-870.0, 912.0))
    assert figure is not None
    assert "2 of 32 points lie outside the axis, triangles at its edge: from −8,700 to 9,120 kN." in figure.caption
    shapes = [layer["mark"].get("shape") for layer in figure.pictures[0].to_dict()["layer"]]
    assert shapes[2:4] == ["triangle-up", "triangle-down"]


@pytest.mark.parametrize("distant", [(), (12.0,), (-400.0, -500.0, -600.0, -700.0, -870.0)])
def test_an_axis_reaches_near_points_and_groups(distant: tuple[float, ...]) -> None:
    made = scattered(*distant)
    figure = stiffness_over_amplitude(made)
    assert figure is not None
    assert "outside" not in figure.caption + drawn(figure)
    assert heights(figure) == pytest.approx([one.stiffness / 1e6 for one in made])


def test_the_axis_ends_three_interquartile_ranges_beyond_the_quartiles() -> None:
    values = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 1000.0])  # quartiles 3 and 7
    assert robust_range(values, np.zeros(9)) == (0.0, 19.0)
    assert robust_range(-values, np.zeros(9)) == (-19.0, 0.0)
    assert robust_range(values[:-1], np.full(8, 2.0)) == (-1.0, 10.0)
