"""Limits of the checks, and the checks of the isolators' motion against them.

The limits are the designer's values from the building file, and Menshin's defaults, which are engineering judgement
unless a source is named. Lead-rubber formulas end at a shear strain of 250 %; expansion joints allow about 50 mm for
small and medium earthquakes (JSSI guideline); 20 % of stiffness is engineering judgement where the maker gives no
range.
"""

from dataclasses import replace

from core.description import IsolationLayer
from core.rounding import plain
from service.verdict.checks import Check, Lacking, Limits, Measured, checked

STRAIN, DESIGN, MOAT, RESIDUAL_OFFSET = "shear_strain", "design_displacement", "moat_clearance", "residual_displacement"
NO_LENGTH = Lacking(reason="The building file gives no length to compare with.", remedy="")
DEFAULT = "Menshin's default"
OF_RUBBER = (1.0, 2.0, 2.5)
"""Shear strain, as a share of the rubber height, that leads to watch, inspect and act."""
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
    return _shares(OF_RUBBER, layer.rubber_height, "rubber_height")


def design_limits(layer: IsolationLayer) -> Limits | Lacking:
    """Limits of the displacement over the design displacement."""
    return _shares(OF_DESIGN, layer.design_displacement, "design_displacement")


def moat_limits(layer: IsolationLayer) -> Limits | Lacking:
    """Limits of the displacement over the moat clearance."""
    return _shares(OF_MOAT, layer.moat_clearance, "moat_clearance")


def first_to_inspect(layer: IsolationLayer) -> float | None:
    """m, smallest displacement at which the isolators are to be inspected; None where no length is known."""
    shares = ((OF_RUBBER, layer.rubber_height), (OF_DESIGN, layer.design_displacement), (OF_MOAT, layer.moat_clearance))
    return min((levels[1] * length for levels, length in shares if length is not None), default=None)


def motion_checks(
    layer: IsolationLayer, displacement: Measured | Lacking, residual: Measured | Lacking
) -> tuple[Check, ...]:
    """Checks of how far the isolators moved, and of what remained, against limits of the building (m)."""
    return (
        _share(STRAIN, displacement, layer.rubber_height, strain_limits(layer)),
        _share(DESIGN, displacement, layer.design_displacement, design_limits(layer)),
        _share(MOAT, displacement, layer.moat_clearance, moat_limits(layer)),
        checked(RESIDUAL_OFFSET, residual, RESIDUAL, unit="m"),
    )


def _share(name: str, displacement: Measured | Lacking, length: float | None, limits: Limits | Lacking) -> Check:
    """A displacement over a length of the building file."""
    if isinstance(limits, Lacking) or length is None:
        return checked(name, NO_LENGTH, limits)
    if isinstance(displacement, Lacking):
        return checked(name, displacement, limits)
    u = displacement.uncertainty
    share = replace(displacement, value=displacement.value / length, uncertainty=None if u is None else u / length)
    return checked(name, share, limits)


def _shares(shares: tuple[float, float, float], length: float | None, key: str) -> Limits | Lacking:
    if length is None:
        return Lacking(
            reason=f"The building file gives no {key}.", remedy=f"Give {key} under [isolation] in the building file."
        )
    watch, inspect, act = shares
    source = f"{DEFAULT}; {key} is {plain(length * MM)} mm in the building file"
    return Limits(watch=watch, inspect=inspect, act=act, source=source)
