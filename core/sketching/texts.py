"""Sentences about a sketched effect."""

from core.rounding import plain
from core.sketching.terms import Scales

FAMILY = "sketched"
EXPLAINED = "A law sketched from records: {}; of at most {}."
"""By its terms, and the places of their amplitudes."""
SKETCHED = "Sketched from records."
SUSPECTED = "The records from which it was sketched show a force that no known effect explains."


def title(terms: str) -> str:
    """Title of the effect."""
    return f"Sketch: {terms}"


def sketched_from(scales: Scales) -> str:
    """Source of the law: the range of its records."""
    return " ".join((SKETCHED, known_range(scales)))


def known_range(scales: Scales) -> str:
    """Sentence on the range that the records show."""
    return (
        f"The records reach {plain(1e3 * scales.displacement, 3)} mm and {plain(1e3 * scales.velocity, 3)} mm/s; "
        "beyond that nothing supports it."
    )
