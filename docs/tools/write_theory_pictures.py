"""Write the pictures of docs/reference/theory.md: `python docs/tools/write_theory_pictures.py`."""

from collections.abc import Iterator
from pathlib import Path

import altair as alt
import numpy as np
from scipy.ndimage import uniform_filter1d

from core.arrays import ComplexMatrix, Indices, Vector
from core.building import fixed_base_modes
from core.estimators.cms import channel_weights
from core.estimators.substructure import assumed_stiffness, static_shapes
from core.estimators.superstructure import InstrumentedSuperstructure
from core.model.simulation import simulate
from core.paper import BUILDING, FOURTH_STOREY, ISOLATOR, RATE, ground_motion
from service.akt013 import recorded

TARGET = Path(__file__).parents[1] / "reference" / "theory.svg"
FREQUENCY = np.geomspace(0.3, 15.0, 240)
"""Hz."""
NOISE = 0.1
"""Noise over the root mean square, in the lower picture."""
SMOOTHED = 41
"""Spectral lines that are averaged, 0.2 Hz."""
GAL = 100.0
"""gal in a m/s²."""
WIDTH, HEIGHT = 640, 230
Row = dict[str, float | str]


def floor_transfer() -> ComplexMatrix:
    """(floors, frequencies) acceleration of every floor by that of the base slab, from the fixed-base modes."""
    modes, ω = fixed_base_modes(BUILDING), 2 * np.pi * FREQUENCY
    participation = modes.shape.T @ BUILDING.floor_mass
    ω_m, ζ_m = modes.angular_frequency[:, None], modes.damping_ratio[:, None]
    relative = participation[:, None] * ω**2 / (ω_m**2 - ω**2 + 2j * ζ_m * ω_m * ω)
    return np.asarray(1 + modes.shape @ relative)


def static_force(transfer: ComplexMatrix, measured: Indices) -> Vector:
    """(frequencies,) |F| by statically interpolated floors, over that of a rigid building."""
    shapes = static_shapes(assumed_stiffness(BUILDING.floor_mass), measured)
    nothing = np.zeros(1)
    known = InstrumentedSuperstructure(
        RATE, nothing, np.zeros((measured.size, 1)), measured, BUILDING.base_mass, BUILDING.floor_mass
    )
    channels = np.vstack([np.ones(FREQUENCY.size), transfer[measured]])
    return np.asarray(np.abs(channel_weights(known, shapes) @ channels) / BUILDING.total_mass)


def forces() -> Iterator[Row]:
    """|F| / (total mass · |a_b|), exact and by two sets of sensors."""
    transfer = floor_transfer()
    roof = BUILDING.floor_mass.size - 1
    ways = {
        "exact": np.abs(BUILDING.base_mass + BUILDING.floor_mass @ transfer) / BUILDING.total_mass,
        "static, from base, 4F and roof": static_force(transfer, np.array([FOURTH_STOREY, roof])),
        "static, from base and roof": static_force(transfer, np.array([roof])),
    }
    for way, values in ways.items():
        for frequency, value in zip(FREQUENCY, values, strict=True):
            yield {"frequency": float(frequency), "value": float(value), "way": way}


def spectra() -> Iterator[Row]:
    """Mean amplitude spectra of base slab and roof under AKT013 in gal s, and of the base slab's noise."""
    response = simulate(BUILDING, ISOLATOR, ground_motion(*recorded()), RATE)
    base, roof = response.base_acceleration * GAL, response.floor_acceleration[-1] * GAL
    level = NOISE * np.sqrt(np.mean(base**2)) * np.sqrt(base.size) / RATE
    lines = np.fft.rfftfreq(base.size, 1 / RATE)
    for way, samples in {"roof": roof, "base slab": base}.items():
        power = uniform_filter1d(np.abs(np.fft.rfft(samples) / RATE) ** 2, SMOOTHED)
        for frequency, value in zip(FREQUENCY, np.interp(FREQUENCY, lines, np.sqrt(power)), strict=True):
            yield {"frequency": float(frequency), "value": float(value), "way": way}
    for frequency in FREQUENCY[[0, -1]]:
        yield {"frequency": float(frequency), "value": float(level), "way": "noise of 10 %"}


def picture(rows: Iterator[Row], title: str, unit: str, decades: tuple[float, ...]) -> alt.LayerChart:
    """Lines over the frequency, and a rule at every fixed-base frequency."""
    x = alt.X(
        "frequency:Q",
        title="frequency, Hz",
        scale=alt.Scale(type="log", domain=[0.3, 15], nice=False),
        axis=alt.Axis(values=[0.3, 0.5, 1, 2, 3, 5, 10, 15], grid=False),
    )
    y = alt.Y(
        "value:Q",
        title=unit,
        scale=alt.Scale(type="log", domain=[decades[0], decades[-1]], nice=False),
        axis=alt.Axis(values=list(decades), gridColor="#e6e8eb"),
    )
    colour = alt.Color("way:N", title=None, sort=None, scale=alt.Scale(range=["#222222", "#1f5fa8", "#d9720f"]))
    line = alt.Chart(alt.Data(values=list(rows))).mark_line(clip=True).encode(x, y, colour)
    fixed = [{"frequency": float(f)} for f in fixed_base_modes(BUILDING).frequency]
    rules = alt.Chart(alt.Data(values=fixed)).mark_rule(strokeDash=[3, 3], color="#9aa1a9").encode(x)
    return (rules + line).properties(width=WIDTH, height=HEIGHT, title=title)


def write() -> None:
    """Both pictures, one above the other."""
    force = picture(
        forces(),
        "Force of the layer over the base slab's acceleration",
        "|F| / (total mass · |acceleration|)",
        (0.01, 0.1, 1.0, 10.0, 100.0),
    )
    motion = picture(
        spectra(),
        "Under AKT013 the base slab hardly moves at the fixed-base frequencies",
        "amplitude spectrum, gal s",
        (0.1, 1.0, 10.0, 100.0, 1000.0),
    )
    both = alt.vconcat(force, motion).resolve_scale(color="independent")
    both.configure(font="sans-serif").configure_view(stroke=None).configure_axis(titleFontWeight="normal").save(
        str(TARGET)
    )


if __name__ == "__main__":
    write()
