"""Residual of a model: over displacement and velocity, over frequency, and its excess error over each covariate."""

from collections.abc import Sequence
from itertools import pairwise

import altair as alt
import numpy as np
import scipy

from core.arrays import Vector
from core.comparison.compared import ForceComparison
from core.comparison.profile import Profile
from core.rounding import plain
from core.workbench.earthquakes import label
from service.documents.charts import (
    BLUE,
    FAINT,
    GREY,
    INK,
    KN,
    MM,
    ORANGE,
    WIDTH,
    brief,
    curves,
    shown_on_hover,
    values,
)
from service.documents.document import Figure, Rows, numbers
from service.models import texts

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
UNITS = {
    "amplitude": ("amplitude (mm)", MM),
    "velocity": ("velocity (mm/s)", MM),
    "largest past displacement": ("largest past displacement (mm)", MM),
    "travel": ("travel in the earthquake (m)", 1.0),
    "cycle": ("cycle", 1.0),
    "time": ("time in the record (s)", 1.0),
    "other direction": ("other direction (mm)", MM),
    "vertical load": ("vertical load / weight", 1.0),
    "temperature": ("temperature (°C)", 1.0),
    "frequency": ("frequency (Hz)", 1.0),
}
"""Label, and users' unit per SI unit, of every covariate that is a number."""


def over_motion(compared: Sequence[ForceComparison]) -> Figure:
    """Mean residual over displacement and velocity, of the earthquakes with the largest motion."""
    strongest = sorted(compared, key=lambda one: -np.abs(one.observation.layer.displacement).max())[:MAPS]
    directions = {one.observation.direction for one in compared}
    maps = [_cells(one, label(one.observation.name, one.observation.direction, directions)) for one in strongest]
    picture = alt.hconcat(*map(_map, maps), spacing=20).resolve_scale(color="independent")
    rows = [row for one in maps for row in one]
    return Figure("motion", *texts.FIGURES["motion"], (picture,), numbers(rows))


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
        alt.Chart(values([row | {"y": row["residual (noise ratio/√Hz)"]} for row in rows]), width=WIDTH, height=240)
        .mark_line(strokeWidth=1.4)
        .encode(
            x=alt.X("frequency (Hz):Q", title="frequency (Hz)").scale(type="log", nice=False),
            y=alt.Y("y:Q", title="residual (noise ratio/√Hz)").scale(type="log").axis(format="~g", values=DECADES),
            color=curves(colours),
            tooltip=[
                alt.Tooltip("curve:N", title="curve"),
                *shown_on_hover("frequency (Hz)", y="residual (noise ratio/√Hz)"),
            ],
        )
    )
    return Figure("spectrum", *texts.FIGURES["spectrum"], (alt.LayerChart(layer=[lines]),), numbers(rows))


def shares(profiles: Sequence[Profile]) -> Figure | None:
    """Share of the excess error over every covariate that is a number, beside the share of the force's energy."""
    measured = [one for one in profiles if not one.classes and one.name in UNITS]
    parts = [_profile(one) for one in measured]
    if not parts:
        return None
    panels = [_bars(rows, UNITS[one.name][0]) for one, rows in zip(measured, parts, strict=True)]
    picture = alt.concat(*panels, columns=3, spacing=26)
    rows = [row for one in parts for row in one]
    return Figure("where", *texts.FIGURES["where"], (picture,), numbers(rows))


def _cells(one: ForceComparison, called: str) -> Rows:
    x, v = one.observation.layer.displacement * MM, one.observation.layer.velocity * MM
    edges = [np.linspace(-np.abs(series).max(), np.abs(series).max(), CELLS + 1) for series in (x, v)]
    sums, _, _ = np.histogram2d(x, v, bins=edges, weights=one.residual * KN)
    counts, _, _ = np.histogram2d(x, v, bins=edges)
    return [
        {
            "earthquake": called,
            "displacement (mm)": brief(edges[0][i]),
            "to (mm)": brief(edges[0][i + 1]),
            "velocity (mm/s)": brief(edges[1][j]),
            "to (mm/s)": brief(edges[1][j + 1]),
            "mean residual (kN)": brief(sums[i, j] / counts[i, j]),
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
            tooltip=shown_on_hover(
                x="displacement (mm)",
                x2="to (mm)",
                y="velocity (mm/s)",
                y2="to (mm/s)",
                residual="mean residual (kN)",
            ),
        )
    )
    return alt.LayerChart(layer=[picture], title=alt.Title(str(rows[0]["earthquake"]), fontSize=13))


def _density(compared: Sequence[ForceComparison]) -> tuple[Vector, Vector]:
    """Hz and (frequencies,) noise ratio per √Hz, of the residual in the band in which the noise is known."""
    length = min(min(one.model.size, round(SEGMENT * one.observation.rate)) for one in compared)
    densities = []
    for one in compared:
        frequency, density = scipy.signal.welch(one.resolved / one.noise.rms, one.observation.rate, nperseg=length)
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


def _profile(one: Profile) -> Rows:
    unit = UNITS[one.name][1]
    names = _ranges([*(part.low * unit for part in one.bins), one.bins[-1].high * unit])
    return [
        {
            "circumstance": one.name,
            "range": name,
            "from": part.low * unit,
            "share of the excess (%)": 100 * part.share.value,
            "low (%)": 100 * part.share.low,
            "high (%)": 100 * part.share.high,
            "share of the force's energy (%)": 100 * part.energy,
            "noise ratio": part.noise_ratio,
        }
        for name, part in zip(names, one.bins, strict=True)
    ]


def _ranges(edges: Sequence[float]) -> list[str]:
    """Names of the ranges between inner edges, with as few digits as distinguish them."""
    inner = edges[1:-1]
    digits = next((d for d in range(2, 9) if len({plain(edge, d) for edge in inner}) == len(inner)), 9)
    labels = [plain(edge, digits) for edge in inner]
    if not labels:
        return ["all"]
    return [f"< {labels[0]}", *(f"{low} – {high}" for low, high in pairwise(labels)), f"> {labels[-1]}"]


def _bars(rows: Rows, label: str) -> alt.LayerChart:
    plain: Rows = [
        {"range": row["range"], "share": row["share of the excess (%)"], "low": row["low (%)"], "high": row["high (%)"]}
        | {"energy": row["share of the force's energy (%)"]}
        for row in rows
    ]
    x = alt.X("range:N", title=label, sort=None).axis(labelAngle=-40, labelLimit=90)
    base = alt.Chart(values(plain), width=230, height=130)
    layers = [
        base.mark_bar(color=BLUE, opacity=0.75).encode(x, alt.Y("share:Q", title="share (%)")),
        base.mark_tick(color=FAINT, thickness=2, width=24).encode(x, alt.Y("energy:Q")),
        base.mark_rule(color=INK).encode(x, alt.Y("low:Q"), alt.Y2("high:Q")),
    ]
    return alt.LayerChart(layer=layers)
