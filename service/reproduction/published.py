"""The numbers that the paper prints in its sections 7 and 8, with their tables and figures.

Using component mode synthesis to estimate the restoring force of an isolation layer subjected to earthquakes
(John Wiley & Sons, 2008). Units are the paper's: Hz, %, t, kN, mm.
"""

from collections.abc import Mapping
from types import MappingProxyType

FREQUENCIES = (1.09, 2.82, 4.61, 6.06, 7.36)
"""Table I: Hz, of the superstructure's first five modes."""
DAMPING_RATIOS = (1.00, 2.59, 4.22, 5.55, 6.74)
"""Table I: %."""

SHAPES: Mapping[float, tuple[float, float]] = MappingProxyType({0.01: (0.4419, -1.0053), 0.10: (0.4385, -1.0281)})
"""Table III: the fourth storey of modes 1 and 2, the roof being 1, identified at two noise levels."""

FIRST_MODAL_FIT: Mapping[float, float] = MappingProxyType({0.01: 92.1, 0.10: 88.6})
"""Figure 10: fitting rate of the first modal acceleration, %."""
SECOND_MODAL_FIT: Mapping[float, float] = MappingProxyType({0.01: 90.8, 0.10: 83.3})
"""Figure 11: the same of the second."""
FORCE_FIT: Mapping[float, float] = MappingProxyType({0.01: 94.6, 0.10: 94.1})
"""Figure 12: the same of the restoring force."""
SCATTERED_FIT = 93.09
"""Figure 16: the same with the masses below."""

MASS_SCALE = 0.9
"""Section 7.2: the first variation of the masses."""
SCATTERED_MASS = (2560.3, 1796.5, 1637.7, 2407.5, 2210.9, 2351.7, 3085.6, 7947.9)
"""Figure 16: t, from the roof down to the base slab."""

REAL_FREQUENCIES = (1.0819, 3.4720)
"""Table IV: Hz, of the building Raiosya."""
REAL_DAMPING_RATIOS = (3.47, 4.45)
"""Table IV: %."""
REAL_SHAPES = (0.3680, -1.4671)
"""Table IV: the fourth storey of modes 1 and 2, the roof being 1."""

STRAIN_OF_THE_DROP = 0.025
"""Section 8: shear strain at which the equivalent stiffness "might drop 50 %"."""
DROP = 50.0
"""Section 8: %."""
