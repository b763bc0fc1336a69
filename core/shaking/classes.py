"""Classes of long-period motion, as the Japan Meteorological Agency defines them; without NumPy, for stored results."""

CLASSES = (0.05, 0.15, 0.50, 1.00)
"""m/s, absolute velocities from which on a motion is of class 1, 2, 3 and 4."""


def long_period_class(velocity: float) -> int:
    """0 to 4, by the largest absolute velocity in m/s."""
    return sum(velocity >= least for least in CLASSES)
