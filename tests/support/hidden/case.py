"""The settings of a trial, parsed from words: hidden laws, sensor errors, a building unlike its description.

A case is words joined by `+`: names of laws, `FAULT@LEVEL` for a sensor that errs, and those of WORDS. `nothing` alone
hides nothing.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from types import MappingProxyType

from hidden.catalogue import LAWS
from hidden.faults import KINDS
from hidden.law import Law
from hidden.sensors import RESOLUTION


@dataclass(frozen=True, slots=True)
class Case:
    """Specification of a trial."""

    laws: tuple[Law, ...] = ()
    faults: tuple[tuple[str, str], ...] = ()
    """Kinds of hidden.faults, each with the level whose accelerometer errs, or `displacement`."""
    design_error: float = 0.03
    """Standard deviation of the described design values of the isolation layer."""
    design_off: float = 0.0
    """The same, by which every one of them is off to either side."""
    total_off: float = 0.0
    """Share by which the described masses are all off to one side."""
    masses_error: float = 0.0
    """Standard deviation of the described floors' shares, their total right."""
    softened: tuple[float, float] = (0.0, 0.0)
    """Range of the share that one storey has lost of its described stiffness."""
    pink: float = 0.0
    """Share of the noise's power."""
    gain_error: float = 0.0
    """Standard deviation of every accelerometer's gain."""
    resolution: float = RESOLUTION
    """m, of the displacement sensor."""
    clock_error: float = 0.0
    """s, standard deviation of every sensor's delay."""
    only_x: bool = False
    """True if the hidden laws act along x alone; the building moves along y too, and that is recorded."""
    moving: bool = False
    """True if the records begin while the building moves."""


WORDS: Mapping[str, Mapping[str, object]] = MappingProxyType(
    {
        "nothing": {},
        "refit": {"design_off": 0.2},
        "mass": {"total_off": 0.1},
        "floor_masses": {"masses_error": 0.2},
        "storey": {"softened": (0.2, 0.4)},
        "pink": {"pink": 0.5},
        "gains": {"gain_error": 0.01},
        "coarse": {"resolution": 2e-4},
        "clocks": {"clock_error": 1e-3},
        "moving": {"moving": True},
        "only_x": {"only_x": True},
    }
)
"""Besides laws and faults; what each changes."""


def parse_case(text: str) -> Case:
    """The case in words."""
    made = Case()
    for word in text.split("+"):
        kind, _, level = word.partition("@")
        if word in LAWS:
            made = replace(made, laws=(*made.laws, LAWS[word]))
        elif kind in KINDS and level:
            made = replace(made, faults=(*made.faults, (kind, level)))
        elif word in WORDS:
            made = replace(made, **WORDS[word])
        else:
            raise ValueError(f"{word!r} is no law, no FAULT@LEVEL and none of {', '.join(WORDS)}")
    if not made.only_x:
        return made
    laws = (replace(law, only_x=True, needs=tuple({*law.needs, "cross"})) for law in made.laws)
    return replace(made, laws=tuple(laws))


def _of(form: str) -> tuple[str, ...]:
    return tuple(name for name, law in LAWS.items() if law.form == form and name != "yielding")


SAME, ANOTHER, OUTSIDE = _of("same"), _of("another"), _of("outside")
"""Cases with one hidden law."""
PAIRED = ("friction", "hardening", "mullins", "heating", "asymmetry", "relief", "maxwell", "stiffness_step")
PAIRS = tuple("+".join(pair) for pair in combinations(PAIRED, 2) if pair != ("mullins", "stiffness_step"))[:25]
"""Cases with two; loss of stiffness with the largest past displacement and at a date between is one and the same."""
ERRING = {
    "gain": ("1F", "RF", "displacement"),
    "delay": ("1F", "RF", "displacement"),
    "polarity": ("ground", "1F", "4F", "RF", "displacement"),
    "swap": ("4F",),
    "rotation": ("1F", "RF"),
    "drift": ("1F", "RF", "displacement"),
    "clipping": ("1F", "RF", "displacement"),
    "spikes": ("1F", "RF", "displacement"),
    "dropped": ("1F", "RF", "displacement"),
    "clock": ("1F", "RF", "displacement"),
}
FAULTS = tuple(f"{kind}@{level}" for kind, levels in ERRING.items() for level in levels)
"""Cases with one sensor that errs and nothing else."""
CORRECTABLE = ("gain@RF", "delay@1F", "polarity@1F", "swap@4F", "rotation@1F", "drift@displacement", "clock@RF")
BESIDE = ("friction", "hardening", "relief", "maxwell", "stiffness_step", "asymmetry")
FAULTS_AND_LAWS = tuple(f"{fault}+{law}" for fault in CORRECTABLE for law in BESIDE)
"""Cases with one sensor that errs and one hidden law: the fault can be corrected in a copy of the records."""
ONE_DIRECTION = tuple(f"{name}+only_x" for name in ("moat", "friction", "maxwell", "relief", "hardening", "asymmetry"))
"""Cases with a law that acts along x alone."""
