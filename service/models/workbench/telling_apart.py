"""Which records would tell effects from each other?"""

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType

from core.effects import EFFECTS


def would_tell(effects: Sequence[str]) -> str:
    """Which records would tell effects from each other."""
    return "; ".join(_hints(effects))


def _hints(effects: Sequence[str]) -> Iterator[str]:
    needs = {need for name in effects for need in EFFECTS[name].needs}
    yield from (hint for need, hint in HINTS.items() if need in needs)
    if any(EFFECTS[name].carried for name in effects):
        yield "a weak earthquake before a strong one, and another after it"
    yield "an earthquake of larger motion, and one of smaller"


HINTS: Mapping[str, str] = MappingProxyType(
    {
        "temperature": "records at temperatures 10 °C apart or more",
        "axial_load": "an earthquake with strong vertical motion, recorded",
        "u_cross": "an earthquake that is strong in both horizontal directions",
        "time": "records from longer before and after",
    }
)
"""By what a law needs."""
