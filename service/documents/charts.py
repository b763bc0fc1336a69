"""The pictures: one definition each, for pages (interactive) and for files (SVG, PNG).

Units are those that engineers of isolated buildings read: mm, kN, kN/mm.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from datetime import UTC, datetime, timedelta
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import altair as alt
from altair.utils.schemapi import _PropertySetter, debug_mode

from core.arrays import Indices, Vector
from service.documents.thinning import along_path, extremes

if TYPE_CHECKING:  # it imports SciPy, which a process that only sends charts does not need
    from core.isolation_layer.equivalent import EquivalentSegment


def _bound(setter: _PropertySetter, owner: object, _: type) -> _PropertySetter:
    """The method `scale` of one axis, and its like; Altair's own is shared, so that threads get each other's axes."""
    made = copy(setter)
    made.obj = owner
    return made


_PropertySetter.__get__ = _bound  # type: ignore[method-assign]

POINTS = 2000
"""Samples of a history in a picture: two for each pixel of a wide one."""
STEP = 1 / 60
"""Distance of two points on a line, as a fraction of a loop's size: chords of a round loop are 1e-4 off."""
MM, MRAD, KN, KN_PER_MM = 1e3, 1e3, 1e-3, 1e-6
TICKS = 8
"""Approximate number of labels on a displacement axis: with more, every second one would be omitted."""
LABELS_APART = 6
"""Pixels at least, between the labels of an axis that has many."""
ESTIMATE, BAND = "estimate", "± 2 standard deviations"
HISTORY = 600
"""Pixels, of a history beside a loop."""
FEW = 10
"""Events that a legend can name."""
TWO_YEARS = timedelta(days=730)
"""Span of events beyond which colours are labelled by year."""
BLUE, GREY, ORANGE = "#1f5fa8", "#b8bec6", "#d9720f"
INK, FAINT, DARK_ORANGE = "#1c2430", "#5b6675", "#8a4a08"
MODELS = (INK, DARK_ORANGE)
"""Colours of models; a direction has at most two that are current, its own and one of both directions."""
MODEL_LINE = 1.8
"""Pixels: a model shows at both sides of the estimate that is drawn on it."""
DARK_COLOURS = {BLUE: "#7ab3ef", GREY: "#5f6a79", ORANGE: "#f0a04b", INK: "#e4e8ee", FAINT: "#9aa5b4"} | {
    DARK_ORANGE: "#f0b45c",
    "white": "#14181f",
    "#555": "#9aa5b4",
}
"""Colours of the marks by those on white, for a dark page; `live.py` has them in every chart."""
DARK_CONFIG = {
    "background": "#14181f",
    "axis": {"labelColor": "#c3cad4", "titleColor": "#e4e8ee", "gridColor": "#2c343f", "domainColor": "#5f6a79"}
    | {"tickColor": "#5f6a79"},
    "title": {"color": "#e4e8ee", "subtitleColor": "#9aa5b4"},
    "legend": {"labelColor": "#c3cad4", "titleColor": "#e4e8ee"},
    "text": {"color": "#e4e8ee"},
}
DARK_STILLS = DARK_COLOURS | {"#000": "#c3cad4", "black": "#c3cad4", "#888": "#5f6a79", "#e6e8eb": "#2c343f"}
"""The same with the colours of axes and words, for still pictures on a dark page."""
LOG_OR_LINEAR = {"log": ["x"]}
"""Metadata of a chart whose horizontal axis is logarithmic or linear, as the reader chooses."""
WIDTH = 860
"""Pixels, of a picture over the whole page."""
Picture = alt.LayerChart | alt.HConcatChart | alt.VConcatChart
CONFIG = {
    "font": "sans-serif",
    "padding": {"left": 5, "top": 5, "right": 20, "bottom": 5},  # a browser's letters may be wider than those laid out
    "axis": {"labelFontSize": 12, "titleFontSize": 13, "titleFontWeight": "normal", "gridColor": "#e6e8eb"},
    "title": {"fontSize": 15, "anchor": "start", "subtitleFontSize": 12, "subtitleColor": "#555"},
    "legend": {"labelFontSize": 12, "titleFontSize": 12},
    "view": {"stroke": None},
}


def restoring_force(
    *,
    time: Vector,
    displacement: Vector,
    force: Vector,
    std: Vector,
    title: str,
    subtitle: str = "",
    models: Mapping[str, Vector] = MappingProxyType({}),
) -> alt.HConcatChart:
    """The loop beside the histories; a window brushed in the force history lights up in the loop.

    Args:
        time: (n,) s.
        displacement: (n,) m, of the isolation layer.
        force: (n,) N.
        std: (n,) N, standard deviation of the force.
        title: what it is of.
        subtitle: a second line.
        models: (n,) N, forces of at most len(MODELS) models for the same displacement, by the models' names.
    """
    brush = alt.selection_interval(encodings=["x"], name="window")
    kept = along_path(displacement, force, STEP)
    motion = _rows(kept, time=time, displacement=displacement * MM, force=force * KN)
    moved_rows = _rows(extremes(displacement, POINTS), time=time, displacement=displacement * MM)
    moved = _line(moved_rows, "displacement", "displacement (mm)").properties(width=HISTORY)
    forces = force_history(time=time, force=force, std=std, models=models).properties(width=HISTORY)
    modelled = []
    for (name, own), colour in zip(models.items(), MODELS, strict=False):
        kept = along_path(displacement, own, STEP)
        rows = _rows(kept, time=time, displacement=displacement * MM, force=own * KN)
        modelled.append(_path(rows, colour, of_model(name)))
    histories = alt.vconcat(moved, forces.add_params(brush), spacing=12)
    heading = alt.Title(title, subtitle=subtitle)
    shown = _over_displacement(displacement, force)
    both: alt.HConcatChart = alt.hconcat(
        _loop(motion, brush, modelled), histories, title=heading, description=shown, spacing=30, config=CONFIG
    )
    shown_apart: alt.HConcatChart = both.resolve_scale(color="independent")  # the legend is that of the force history
    return shown_apart


def loop(*, time: Vector, displacement: Vector, force: Vector, title: str, subtitle: str = "") -> alt.LayerChart:
    """Restoring force (N) over displacement (m) of the isolation layer, all of one record."""
    kept = along_path(displacement, force, STEP)
    rows = _rows(kept, time=time, displacement=displacement * MM, force=force * KN)
    heading, shown = alt.Title(title, subtitle=subtitle), _over_displacement(displacement, force)
    layers = [_path(rows, BLUE)]
    return alt.LayerChart(layer=layers, title=heading, description=shown, width=460, height=380, config=CONFIG)


def _over_displacement(displacement: Vector, force: Vector) -> str:
    """Summary of a loop for readers who do not see it."""
    return (
        "Restoring force of the isolation layer over its displacement: displacement "
        f"{_least(displacement * MM)} to {_most(displacement * MM)} mm, "
        f"force {_least(force * KN)} to {_most(force * KN)} kN."
    )


def _least(values: Vector) -> str:
    return f"{values.min():.3g}"


def _most(values: Vector) -> str:
    return f"{values.max():.3g}"


def force_history(
    *, time: Vector, force: Vector, std: Vector, models: Mapping[str, Vector] = MappingProxyType({})
) -> alt.LayerChart:
    """Restoring force (N) over time (s), with a band of ± 2 standard deviations (N), and forces of models by name."""
    named = {of_model(name): own * KN for name, own in models.items()}
    return _banded(time, force * KN, std * KN, ("force", "force (kN)"), named)


def of_model(name: str) -> str:
    """Name of a model's force in a chart."""
    return f"force of model {name}"


def begun_at(start: datetime, chart: Picture) -> Picture:
    """The chart with the time from which it counts seconds, so that charts of a page show the same instant."""
    shown: Picture = chart.properties(usermeta={"start": _milliseconds(start)})
    return shown


def _banded(
    time: Vector,
    values: Vector,
    std: Vector,
    quantity: tuple[str, str],
    models: Mapping[str, Vector] = MappingProxyType({}),
) -> alt.LayerChart:
    """A history with its band on those of models, in the unit of the axis; the quantity by its name and its label."""
    name, label = quantity
    unit = label.rpartition("(")[2].removesuffix(")")
    columns = {"time": time, name: values, "low": values - 2 * std, "high": values + 2 * std}
    rows = _rows(extremes(values, POINTS), **columns)
    across = alt.X("time:Q", title="time after the start of the record (s)").scale(nice=False)
    colour = curves({ESTIMATE: BLUE, BAND: ORANGE} | dict(zip(models, MODELS, strict=False)))
    band = alt.Chart(rows).mark_area(opacity=0.3).encode(x=across, y="low:Q", y2="high:Q", color=colour)
    line = _line(rows, name, label).encode(
        color=colour,
        tooltip=_tooltips({"time": "time (s)", name: label, "low": f"from ({unit})", "high": f"to ({unit})"}),
    )
    modelled = []
    for model, own in models.items():
        drawn = _line(_rows(extremes(own, POINTS), time=time, **{name: own}), name, label, MODEL_LINE)
        tooltip = _tooltips({"time": "time (s)", name: f"{model} ({unit})"})
        modelled.append((drawn.encode(color=colour, tooltip=tooltip), model))
    drawn_in_order = ((band, BAND), *modelled, (line, ESTIMATE))
    layers = [one.transform_calculate(curve=f"'{curve}'") for one, curve in drawn_in_order]
    return alt.LayerChart(layer=layers, width=400, height=150)


def orbit(time: Vector, x: Vector, y: Vector) -> alt.LayerChart:
    """Path of the isolation layer in plan (m over m), to one scale along both axes."""
    kept = along_path(x, y, STEP)
    rows = _rows(kept, time=time, x=x * MM, y=y * MM)
    largest = 1.05 * MM * max(float(abs(x).max()), float(abs(y).max())) or 1.0
    scale = alt.Scale(domain=[-largest, largest], nice=False)
    axis = alt.Axis(tickCount=TICKS, labelSeparation=LABELS_APART)
    path = (
        alt.Chart(rows)
        .mark_line(color=BLUE, strokeWidth=1, strokeJoin="round")
        .encode(
            x=alt.X("x:Q", title="displacement of the isolation layer in x (mm)", scale=scale, axis=axis),
            y=alt.Y("y:Q", title="displacement of the isolation layer in y (mm)", scale=scale, axis=axis),
            order="time:Q",
            tooltip=_tooltips({"time": "time (s)", "x": "x (mm)", "y": "y (mm)"}),
        )
    )
    shown = (
        f"Path of the isolation layer in plan: x {_least(x * MM)} to {_most(x * MM)} mm, "
        f"y {_least(y * MM)} to {_most(y * MM)} mm."
    )
    return alt.LayerChart(layer=[path], title="Path in plan", description=shown, width=380, height=380, config=CONFIG)


def torsion_history(time: Vector, torsion: Vector, std: Vector) -> alt.LayerChart:
    """Torsion of the isolation layer (rad) over time (s), with a band of ± 2 standard deviations (rad)."""
    shown = f"Torsion of the isolation layer over time, {_least(torsion * MRAD)} to {_most(torsion * MRAD)} mrad."
    chart = _banded(time, torsion * MRAD, std * MRAD, ("torsion", "torsion (mrad)"))
    return chart.properties(title="Torsion", description=shown, config=CONFIG)


def axial_load_history(time: Vector, ratio: Vector) -> alt.LayerChart:
    """Vertical force on the isolators over the weight, over time (s)."""
    rows = _rows(extremes(ratio, POINTS), time=time, load=ratio)
    line = _line(rows, "load", "load (N/W)")
    shown = f"Vertical force on the isolators over time, {_least(ratio)} to {_most(ratio)} of the weight."
    chart = alt.LayerChart(layer=[line], title="Vertical load on the isolators", width=400, height=150, config=CONFIG)
    return chart.properties(description=shown)


def equivalent_stiffness(events: Mapping[datetime, "Sequence[EquivalentSegment]"], title: str) -> alt.LayerChart:
    """k_eq over amplitude, one point a cycle, coloured by event; bars are ± 1 standard deviation."""
    return _over_amplitude(events, "k_eq", "equivalent stiffness k_eq (kN/mm)", title)


def equivalent_damping(events: Mapping[datetime, "Sequence[EquivalentSegment]"], title: str) -> alt.LayerChart:
    """c_eq over amplitude, one point a cycle, coloured by event; bars are ± 1 standard deviation."""
    return _over_amplitude(events, "c_eq", "equivalent damping coefficient c_eq (kN s/mm)", title)


class _Shared(alt.InlineData):
    """Data that all layers of a picture share; Altair would copy them for each."""

    def __deepcopy__(self, memo: object = None) -> "_Shared":
        return self


def values(rows: Sequence[Mapping[str, Any]]) -> alt.InlineData:
    """Rows as data of a picture; Altair would check every one of them against its schema, in 0.1 ms each."""
    with debug_mode(arg=False):
        return _Shared(values=list(rows))


def specification(draw: Callable[[], Picture]) -> dict[str, Any]:
    """A picture's specification, not checked against the schema of Vega-Lite, which takes longer than to make it."""
    with debug_mode(arg=False):
        made: dict[str, Any] = draw().to_dict(validate=False)
    return made


def curves(colours: Mapping[str, str]) -> alt.Color:
    """A colour for each `curve`, named above the picture."""
    legend = alt.Legend(title=None, orient="top", symbolType="stroke", symbolStrokeWidth=3, symbolOpacity=1.0)
    return alt.Color("curve:N", scale=alt.Scale(domain=list(colours), range=list(colours.values())), legend=legend)


def shown_on_hover(*names: str, **titles: str) -> list[alt.Tooltip]:
    """Tooltips of fields: of those that are named for their readers, and of others by their titles."""
    return _tooltips({name: name for name in names} | titles)


def wider(curve: str, wide: float, narrow: float, field: str = "curve") -> Any:  # noqa: ANN401  Altair's is private
    """Widths of lines (pixels): one curve is wide, so that the others are seen on it."""
    return alt.condition(f"datum.{field} === '{curve}'", alt.value(wide), alt.value(narrow))


def brief(value: float) -> float:
    """A number to six digits: more are not seen and triple a page."""
    return float(f"{value:.6g}")


def _loop(rows: alt.InlineData, brush: alt.Parameter, models: Sequence[alt.Chart]) -> alt.LayerChart:
    """All of the loop in grey, the brushed part in colour, also of models; without a brush all is in colour."""
    coloured = [one.transform_filter(brush) for one in (*models, _path(rows, BLUE))]
    layers = [_path(rows, GREY), *coloured]
    return alt.LayerChart(layer=layers, width=400, height=380)


def _path(rows: alt.InlineData, colour: str, model: str = "") -> alt.Chart:
    name, unit, width = (model, "kN", MODEL_LINE) if model else ("force", "kN", 1)
    chart: alt.Chart = (
        alt.Chart(rows)
        .mark_line(color=colour, strokeWidth=width, strokeJoin="round")
        .encode(
            x=alt.X("displacement:Q", title="displacement of the isolation layer (mm)").axis(tickCount=TICKS),
            y=alt.Y("force:Q", title="restoring force (kN)"),
            order="time:Q",
            tooltip=_tooltips({"time": "time (s)", "displacement": "displacement (mm)", "force": f"{name} ({unit})"}),
        )
    )
    return chart


def _line(rows: alt.InlineData, name: str, label: str, width: float = 1) -> alt.Chart:
    chart: alt.Chart = (
        alt.Chart(rows, width=400, height=150)
        .mark_line(color=BLUE, strokeWidth=width)
        .encode(
            x=alt.X("time:Q", title="time after the start of the record (s)").scale(nice=False),
            y=alt.Y(f"{name}:Q", title=label).scale(zero=False),
            tooltip=_tooltips({"time": "time (s)", name: label}),
        )
    )
    return chart


def _over_amplitude(
    events: Mapping[datetime, "Sequence[EquivalentSegment]"], name: str, label: str, title: str
) -> alt.LayerChart:
    rows = _cycles(events)
    across = alt.X("amplitude:Q", title="displacement amplitude of the cycle (mm)")
    across = across.scale(type="log", nice=False, padding=12).axis(labelSeparation=LABELS_APART)
    colour = _colour(list(events))
    bars = alt.Chart(rows).mark_rule(opacity=0.4).encode(across, y=f"{name}_low:Q", y2=f"{name}_high:Q", color=colour)
    tooltips = _tooltips({"amplitude": "amplitude (mm)", name: label, f"{name}_std": "standard deviation"})
    points = (
        alt.Chart(rows)
        .mark_circle(size=45, opacity=0.8)
        .encode(
            across,
            alt.Y(f"{name}:Q", title=label).scale(zero=True),
            color=colour,
            tooltip=[*tooltips, alt.Tooltip("event:N", title="event (UTC)")],
        )
    )
    layers, usermeta = [bars, points], LOG_OR_LINEAR
    return alt.LayerChart(layer=layers, title=title, width=460, height=380, config=CONFIG, usermeta=usermeta)


def _colour(events: Sequence[datetime]) -> alt.Color:
    """A colour for each of a few events; for many, the older the darker, so that a drift shows."""
    if len(events) <= FEW:
        legend = alt.Legend(symbolOpacity=1.0)
        return alt.Color("event:N", title="event (UTC)", legend=legend).scale(scheme="tableau10")
    first, last = min(events), max(events)
    if last - first > TWO_YEARS:
        years = range(first.year, last.year + 1, 1 + (last.year - first.year) // FEW)
        middles = (datetime(year, 7, 1, tzinfo=UTC) for year in years)
        form, shown = "%Y", [min(max(middle, first), last) for middle in middles]
    else:
        form, shown = "%Y-%m-%d", [first, first + (last - first) / 2, last]
    ticks = [_milliseconds(moment) for moment in shown]
    legend = alt.Legend(values=ticks, labelExpr=f"utcFormat(datum.value, '{form}')")
    scheme = alt.SchemeParams(name="viridis", extent=[0, 0.85])  # its last yellow is barely visible on white
    return alt.Color("moment:Q", title="event (UTC)").scale(scheme=scheme).legend(legend)


def _milliseconds(moment: datetime) -> float:
    """Since 1970, as pictures count time."""
    return moment.timestamp() * 1e3


def _tooltips(titles: Mapping[str, str]) -> list[alt.Tooltip]:
    return [alt.Tooltip(f"{name}:Q", title=title, format=".4~g") for name, title in titles.items()]


def _cycles(events: Mapping[datetime, "Sequence[EquivalentSegment]"]) -> alt.InlineData:
    rows = []
    for start, cycles in events.items():
        for cycle in cycles:
            k_eq, k_std = cycle.k_eq * KN_PER_MM, cycle.k_eq_std * KN_PER_MM
            c_eq, c_std = cycle.c_eq * KN_PER_MM, cycle.c_eq_std * KN_PER_MM
            rows.append(
                {"event": f"{start:%Y-%m-%d %H:%M:%S}", "moment": _milliseconds(start)}
                | {"amplitude": cycle.amplitude * MM}
                | {"k_eq": k_eq, "k_eq_std": k_std, "k_eq_low": k_eq - k_std, "k_eq_high": k_eq + k_std}
                | {"c_eq": c_eq, "c_eq_std": c_std, "c_eq_low": c_eq - c_std, "c_eq_high": c_eq + c_std}
            )
    return values(rows)


def _rows(kept: Indices, **columns: Vector) -> alt.InlineData:
    """The kept samples as records."""
    names: Iterable[str] = columns.keys()
    each = zip(*(column[kept].tolist() for column in columns.values()), strict=True)
    return values([dict(zip(names, map(brief, row), strict=True)) for row in each])
