"""Checks of how far the isolators moved: shear strain, displacement over design and moat, residual displacement."""

from dataclasses import replace

from core.description import IsolationLayer
from service.verdict.checks import Check, Lacking, Limits, Measured, checked
from service.verdict.limits import RESIDUAL, design_limits, moat_limits, strain_limits

STRAIN, DESIGN, MOAT, RESIDUAL_OFFSET = "shear_strain", "design_displacement", "moat_clearance", "residual_displacement"
NO_LENGTH = Lacking(reason="The building file gives no length to compare with.", remedy="")


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
