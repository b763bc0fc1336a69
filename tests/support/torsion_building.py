"""A building whose base slab rotates: two-axis sensors, transducers at two corners and a vertical accelerometer."""

from functools import cache

import numpy as np
import paper_records
from biaxial_records import biaxial_records
from ground_motions import kobe

from core.arrays import Vector

LAYER, VERTICAL = "XX.PAPER.01.HY", "XX.PAPER.01.HNZ"
CORNERS = {"A": (12.0, 9.0), "B": (-12.0, -9.0)}
"""m from the centre of mass, of the displacement transducers."""
TRANSDUCER_NOISE = 2e-5
"""m."""
RATIO = 0.02
"""1/m: torsion over the displacement in x, as an eccentricity would make it."""


@cache
def exact() -> tuple[Vector, Vector, Vector, Vector]:
    """(n,) m, m, rad and vertical force over weight: what is to be found."""
    _, samples = biaxial_records(noise=0.0)
    vertical = 1 + 2 * np.roll(kobe(), 300) / 9.80665
    return samples[f"{LAYER}X"], samples[f"{LAYER}Y"], RATIO * samples[f"{LAYER}X"], vertical


def records(seed: int) -> dict[str, Vector]:
    """(n,) SI units by channel, of the motion of `exact`."""
    rng = np.random.default_rng(seed)
    x, y, turn, vertical = exact()
    _, samples = biaxial_records()
    kept = {name: values for name, values in samples.items() if not name.startswith(LAYER)}
    for corner, (east, north) in CORNERS.items():
        kept[f"XX.PAPER.{corner}.HYX"] = x - turn * north + TRANSDUCER_NOISE * rng.standard_normal(x.size)
        kept[f"XX.PAPER.{corner}.HYY"] = y + turn * east + TRANSDUCER_NOISE * rng.standard_normal(x.size)
    kept[VERTICAL] = (vertical - 1) * 9.80665 + 1e-3 * rng.standard_normal(x.size)
    return kept


def building_file() -> str:
    """The building in TOML."""
    top = paper_records.building_file().split("[[channel]]")[0]
    levels = {name.split(".")[2]: level for name, (level, _) in paper_records.SENSORS.items()}
    lines = []
    for name in records(0):
        _, _, location, code = name.split(".")
        quantity = "displacement" if code[1] == "Y" else "acceleration"
        lines += ["[[channel]]", f'id = "{name}"', f'level = "{levels.get(location, "1F")}"']
        lines += [f'direction = "{code[2].lower()}"', f'quantity = "{quantity}"', f"gain = {paper_records.GAIN}"]
        if location in CORNERS:
            lines.append(f"position = {list(CORNERS[location])}")
    return top + "\n".join(lines) + "\n"


def miniseed(seed: int) -> bytes:
    """The records in counts."""
    return paper_records.miniseed(records(seed))
