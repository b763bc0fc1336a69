"""Limits of the checks: the designer's values from the building file, and Menshin's defaults.

The defaults are engineering judgement unless a source is named. Lead-rubber formulas end at a shear strain of 250 %;
expansion joints allow about 50 mm for small and medium earthquakes (JSSI guideline); 20 % of stiffness is engineering
judgement where the maker gives no range.
"""

from core.description import IsolationLayer
from core.rounding import plain
from service.verdict.checks import Lacking, Limits

DEFAULT = "Menshin's default"
STRAIN = (1.0, 2.0, 2.5)
"""Shear strain that leads to watch, inspect and act."""
OF_DESIGN = (0.33, 0.67, 1.0)
"""Share of the design displacement that leads to watch, inspect and act."""
OF_MOAT = (0.5, 0.75, 0.9)
"""Share of the moat clearance that leads to watch, inspect and act."""
RESIDUAL = Limits(watch=0.010, inspect=0.030, act=0.050, source=DEFAULT)
"""m."""
TOLERANCE = 0.20
"""Relative change of stiffness beyond which the isolators are to be inspected."""
STIFFNESS = Limits(watch=0.10, inspect=TOLERANCE, source=DEFAULT)
"""Relative, of either sign, at equal amplitude and temperature."""
MM = 1e3


def strain_limits(layer: IsolationLayer) -> Limits | Lacking:
    """Limits of the shear strain."""
    return _shares(STRAIN, layer.rubber_height, "rubber_height")


def design_limits(layer: IsolationLayer) -> Limits | Lacking:
    """Limits of the displacement over the design displacement."""
    return _shares(OF_DESIGN, layer.design_displacement, "design_displacement")


def moat_limits(layer: IsolationLayer) -> Limits | Lacking:
    """Limits of the displacement over the moat clearance."""
    return _shares(OF_MOAT, layer.moat_clearance, "moat_clearance")


def first_to_inspect(layer: IsolationLayer) -> float | None:
    """m, smallest displacement at which the isolators are to be inspected; None where no length is known."""
    lengths = ((STRAIN, layer.rubber_height), (OF_DESIGN, layer.design_displacement), (OF_MOAT, layer.moat_clearance))
    return min((shares[1] * length for shares, length in lengths if length is not None), default=None)


def _shares(shares: tuple[float, float, float], length: float | None, key: str) -> Limits | Lacking:
    if length is None:
        return Lacking(
            reason=f"The building file gives no {key}.", remedy=f"Give {key} under [isolation] in the building file."
        )
    watch, inspect, act = shares
    source = f"{DEFAULT}; {key} is {plain(length * MM)} mm in the building file"
    return Limits(watch=watch, inspect=inspect, act=act, source=source)
