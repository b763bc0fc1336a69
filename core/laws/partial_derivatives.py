"""What are the partial derivatives of the functions that a law may call?

Each is a piece of source in the arguments {0}, {1} and the function's own value {y}. Where a function has no derivative
(the root at zero) it is zero: a law that stands there at rest stays there.
"""

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

PARTIAL_DERIVATIVES: Mapping[Callable[..., Any], tuple[str, ...]] = MappingProxyType(
    {
        abs: ("math.copysign(1.0, {0})",),
        math.fabs: ("math.copysign(1.0, {0})",),
        math.exp: ("{y}",),
        math.expm1: ("({y} + 1.0)",),
        math.log: ("1.0 / {0}",),
        math.log1p: ("1.0 / (1.0 + {0})",),
        math.sqrt: ("(0.5 / {y} if {y} else 0.0)",),
        math.sin: ("math.cos({0})",),
        math.cos: ("-math.sin({0})",),
        math.tan: ("(1.0 + {y} * {y})",),
        math.atan: ("1.0 / (1.0 + {0} * {0})",),
        math.sinh: ("math.cosh({0})",),
        math.cosh: ("math.sinh({0})",),
        math.tanh: ("(1.0 - {y} * {y})",),
        math.copysign: ("math.copysign(1.0, {0}) * math.copysign(1.0, {1})", "0.0"),
        math.hypot: ("({0} / {y} if {y} else 0.0)", "({1} / {y} if {y} else 0.0)"),
        math.pow: (
            "({1} * {y} / {0} if {0} else (1.0 if {1} == 1.0 else 0.0))",
            "({y} * math.log({0}) if {0} > 0.0 else 0.0)",
        ),
        min: ("(1.0 if {0} <= {1} else 0.0)", "(0.0 if {0} <= {1} else 1.0)"),
        max: ("(1.0 if {0} >= {1} else 0.0)", "(0.0 if {0} >= {1} else 1.0)"),
    }
)
