"""Numbers as people read them: no more digits than their uncertainty supports.

Pages, messages, terminals and reports print through these functions; JSON and CSV keep full precision.

- `with_std(value, std)`: a value and its standard deviation, as in `8,630 ± 120`, or `8,630` where none is known.
- `apart(value, std)`: the same for two columns; `supported(value, std)`: the value alone.
- `interval(value, low, high)`: a value and the ends of its interval, as in `−8.1 (95 %: −9.9 to −6.2)`.
- `significant(value)`: a measured value of unknown uncertainty, as in `8,630` or `12.0`.
- `plain(value)`: a value that was set, not measured, as in `12`.

The standard deviation gets two digits where they begin with 10 to 35, else one, and the value ends at the same place:
the rule of the Review of Particle Physics (2024), introduction, section 5.3.
"""

import math

LONG = 1e7
"""Smallest number that is written with a power of ten for its size. Not tuned."""
SHORT = 1e-4
"""Number below which a power of ten is written. Not tuned."""
LEAST = -300
"""Least power of ten: smaller ones are not exact, and then 0."""
SIGNIFICANT = 3
"""Digits of a value whose uncertainty is unknown. Not tuned."""
TWO_DIGITS = 354
"""Largest first three digits of a standard deviation of which two are written."""
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
"""Superscripts of exponents."""


def with_std(value: float, std: float | None, unit: str = "", *, digits: int = SIGNIFICANT) -> str:
    """A value and its standard deviation, rounded at the same place.

    Args:
        value: any unit.
        std: the same unit. None or 0 if unknown: the value alone, to its significant digits. Not finite if the value
            is not determined, which is then written.
        unit: written behind, if any.
        digits: significant digits of a value whose standard deviation is unknown.
    """
    if not math.isfinite(value):
        return "not determined"
    if std is None or std == 0:
        return _behind(significant(value, digits), unit)
    if not math.isfinite(std):
        return _behind(f"{significant(value, digits)} (not determined)", unit)
    number, spread, power = _pair(value, std)
    return _behind(f"({number} ± {spread}) · {power}" if power else f"{number} ± {spread}", unit)


def apart(value: float, std: float) -> tuple[str, str]:
    """A value and its standard deviation, rounded at the same place, for two columns of a table.

    Args:
        value: any unit.
        std: the same unit, finite and positive.
    """
    number, spread, power = _pair(value, std)
    return (f"{number} · {power}", f"{spread} · {power}") if power else (number, spread)


def supported(value: float, std: float | None, unit: str = "") -> str:
    """A value alone, to the digit that its standard deviation supports; where that is unknown, to its first digits."""
    known = std is not None and math.isfinite(std) and std > 0
    return _behind(apart(value, std)[0] if known and std is not None else significant(value), unit)


def interval(value: float, low: float, high: float, unit: str = "", *, level: str = "95 %", signed: bool = True) -> str:
    """A value and the ends of its interval, to the digit that the interval's half-width supports.

    Args:
        value: any unit.
        low: lower end, the same unit.
        high: upper end, the same unit.
        unit: written behind the value and behind the interval, if any.
        level: coverage of the interval.
        signed: whether positive numbers get a sign, as changes do.
    """
    if not (math.isfinite(value) and math.isfinite(low) and math.isfinite(high)):
        return with_std(value, math.inf, unit)
    half = (high - low) / 2
    decimals = _decimals(half) if half > 0 else _last_place(value)
    number, first, last = (_to_place(one, decimals, signed=signed) for one in (value, low, high))
    return f"{_behind(number, unit)} ({level}: {first} to {_behind(last, unit)})"


def significant(value: float, digits: int = SIGNIFICANT) -> str:
    """A value of unknown uncertainty, to its first digits; a power of ten only where the number is long."""
    if not math.isfinite(value):
        return "not determined"
    power = _power(value)
    if power:
        return f"{_to_place(value / 10.0**power, digits - 1)} · {_ten_to(power)}"
    return _to_place(value, _last_place(value, digits))


def plain(value: float, digits: int = 4) -> str:
    """A value that was set or is a limit, without zeros behind its last digit."""
    number, raised, power = significant(value, digits).partition(" · ")
    return (number.rstrip("0").rstrip(".") if "." in number else number) + raised + power


def _pair(value: float, std: float) -> tuple[str, str, str]:
    """Both at the same place, and the power of ten that both have; none where they are short."""
    power = _power(max(abs(value), std))
    decimals = _decimals(std / 10.0**power)
    number, spread = (_to_place(one / 10.0**power, decimals) for one in (value, std))
    return number, spread, _ten_to(power) if power else ""


def _behind(number: str, unit: str) -> str:
    return f"{number} {unit}" if unit else number


def _power(value: float) -> int:
    """Exponent to write of a number that is too long without one; else 0."""
    return max(math.floor(math.log10(abs(value))), LEAST) if value and not SHORT <= abs(value) < LONG else 0


def _ten_to(power: int) -> str:
    return f"10{str(power).translate(RAISED)}"


def _last_place(value: float, digits: int = SIGNIFICANT) -> int:
    """Decimals of a number's last significant digit; negative left of the point."""
    return digits - 1 - int(f"{value:.{digits - 1}e}".partition("e")[2]) if value else 0


def _decimals(std: float) -> int:
    """Decimals to which a value of this standard deviation is written; negative left of the point."""
    mantissa, _, exponent = f"{std:.2e}".partition("e")
    return (1 if round(100 * float(mantissa)) <= TWO_DIGITS else 0) - int(exponent)


def _to_place(value: float, decimals: int, *, signed: bool = False) -> str:
    rounded = round(value, decimals) + 0.0  # what rounds to −0 is 0
    return f"{rounded:{'+' if signed and rounded else ''},.{max(decimals, 0)}f}".replace("-", "−")
