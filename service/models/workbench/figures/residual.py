"""Residual of a model over displacement and velocity, and over frequency."""

from collections.abc import Sequence

import altair as alt
import numpy as np
from scipy import signal

from core.arrays import Vector
from core.comparison.compared import ForceComparison
from core.workbench.earthquakes import label
from service.models.workbench.figure import WIDTH, Figure, Rows, curves, table, values
from service.reports.charts import BLUE, GREY, KN, MM, ORANGE

CELLS = 19
"""Along each axis of displacement and velocity."""
MAPS = 3
"""Earthquakes whose residual is mapped, those of the largest motion."""
DECADES = [10.0**power for power in range(-6, 7)]
"""Labels of a logarithmic axis."""
SEGMENT = 20.0
"""s, of a spectrum."""
CURVE = 60
"""Points of the noise's curve."""
NOISE, BEFORE, AFTER = "noise", "model", "with what is proposed"


def over_motion(compared: Sequence[ForceComparison]) -> Figure:
    """Mean residual over displacement and velocity, of the earthquakes with the largest motion."""
    strongest = sorted(compared, key=lambda one: -np.abs(one.observation.layer.displacement).max())[:MAPS]
    directions = {one.observation.direction for one in compared}
    maps = [_cells(one, label(one.observation.name, one.observation.direction, directions)) for one in strongest]
    caption = (
        "Mean of what the model leaves (measured − model) where displacement and velocity were so, each earthquake to "
        "its own scale. Bands along the velocity are a damping law that is not linear, ends along the displacement an "
        "elastic one, a turn between the quadrants a hysteresis."
    )
    picture = alt.hconcat(*map(_map, maps), spacing=20).resolve_scale(color="independent")
    rows = [row for one in maps for row in one]
    return Figure("motion", "Residual over displacement and velocity", caption, picture, table(rows))


def spectrum(compared: Sequence[ForceComparison], after: Sequence[ForceComparison] = ()) -> Figure:
    """Residual over frequency against the noise, of all earthquakes, each in its own noise.

    Args:
        compared: the model.
        after: another model, if there is one to show beside it.
    """
    shown = {BEFORE: compared, AFTER: after} if after else {BEFORE: compared}
    curves_shown = {name: _density(some) for name, some in shown.items()} | {NOISE: _noise_density(compared)}
    rows: Rows = [
        {"curve": name, "frequency (Hz)": float(f), "residual (noise ratio/√Hz)": float(value)}
        for name, (frequency, density) in curves_shown.items()
        for f, value in zip(frequency, density, strict=True)
    ]
    colours = {name: {BEFORE: BLUE, AFTER: ORANGE, NOISE: GREY}[name] for name in (*shown, NOISE)}
    lines = (
        alt.Chart(values(rows), width=WIDTH, height=240)
        .mark_line(strokeWidth=1.4)
        .encode(
            x=alt.X("frequency (Hz):Q").scale(type="log", nice=False),
            y=alt.Y("residual (noise ratio/√Hz):Q").scale(type="log").axis(format="~g", values=DECADES),
            color=curves(colours),
        )
    )
    caption = (
        "What the model leaves over frequency, each earthquake in multiples of its own noise. Above the noise about "
        "the frequency of the motion: the layer's law; far above it: impact, stick-slip or the superstructure."
    )
    return Figure("spectrum", "Residual spectrum", caption, alt.LayerChart(layer=[lines]), table(rows))


def _cells(one: ForceComparison, called: str) -> Rows:
    x, v = one.observation.layer.displacement * MM, one.observation.layer.velocity * MM
    edges = [np.linspace(-np.abs(series).max(), np.abs(series).max(), CELLS + 1) for series in (x, v)]
    sums, _, _ = np.histogram2d(x, v, bins=edges, weights=one.residual * KN)
    counts, _, _ = np.histogram2d(x, v, bins=edges)
    return [
        {
            "earthquake": called,
            "displacement (mm)": float(edges[0][i]),
            "to (mm)": float(edges[0][i + 1]),
            "velocity (mm/s)": float(edges[1][j]),
            "to (mm/s)": float(edges[1][j + 1]),
            "mean residual (kN)": float(sums[i, j] / counts[i, j]),
        }
        for i, j in zip(*np.nonzero(counts), strict=True)
    ]


def _map(rows: Rows) -> alt.LayerChart:
    # a full stop or a bracket in a field's name would be read as a path
    plain: Rows = [
        {"x": row["displacement (mm)"], "x2": row["to (mm)"], "y": row["velocity (mm/s)"], "y2": row["to (mm/s)"]}
        | {"residual": row["mean residual (kN)"]}
        for row in rows
    ]
    largest = max(abs(row["residual"]) for row in plain) or 1.0
    scale = alt.Scale(scheme="blueorange", domain=[-largest, largest])
    picture = (
        alt.Chart(values(plain), width=205, height=205)
        .mark_rect()
        .encode(
            x=alt.X("x:Q", title="displacement (mm)").scale(nice=False),
            x2="x2:Q",
            y=alt.Y("y:Q", title="velocity (mm/s)").scale(nice=False),
            y2="y2:Q",
            color=alt.Color("residual:Q", title="kN", scale=scale),
        )
    )
    return alt.LayerChart(layer=[picture], title=alt.Title(str(rows[0]["earthquake"]), fontSize=13))


def _density(compared: Sequence[ForceComparison]) -> tuple[Vector, Vector]:
    """Hz and (frequencies,) noise ratio per √Hz, of the residual in the band in which the noise is known."""
    length = min(min(one.model.size, round(SEGMENT * one.observation.rate)) for one in compared)
    densities = []
    for one in compared:
        frequency, density = signal.welch(one.resolved / one.noise.rms, one.observation.rate, nperseg=length)
        densities.append(density)
    low, high = _known_band(compared)
    mean, within = np.sqrt(np.mean(densities, axis=0)), (frequency >= low) & (frequency <= high)
    return frequency[within], mean[within]


def _noise_density(compared: Sequence[ForceComparison]) -> tuple[Vector, Vector]:
    """Hz and (frequencies,) noise ratio per √Hz of a correct model."""
    frequency = np.geomspace(*_known_band(compared), CURVE)
    densities = []
    for one in compared:
        weights = one.noise.whitening
        power = 2 * weights.std**2 / (one.observation.rate * one.noise.rms**2)
        densities.append(np.interp(frequency, weights.frequency, power))
    return frequency, np.asarray(np.sqrt(np.mean(densities, axis=0)))


def _known_band(compared: Sequence[ForceComparison]) -> tuple[float, float]:
    """Hz, frequencies at which the noise of every earthquake is known."""
    known = [one.noise.whitening.frequency for one in compared]
    return max(float(one[0]) for one in known), min(float(one[-1]) for one in known)
