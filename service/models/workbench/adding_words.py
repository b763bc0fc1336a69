"""What should an engineer know of an effect that was added?"""

from collections.abc import Iterator

from core.diagnosis.ranking import DECISIVE
from core.effects import EFFECTS
from core.rounding import plain
from service.models.workbench.adding import Added
from service.models.workbench.effect_sheets import explained
from service.models.workbench.fit_words import words as fit_words
from service.models.workbench.versions import gain


def words(found: Added) -> tuple[str, ...]:
    """Sentences: what it does here, whether the records ask for it, what became of the error, and of the fit."""
    return tuple(_sentences(found))


def _sentences(found: Added) -> Iterator[str]:
    about, tried = EFFECTS[found.effect], found.candidate
    bic = f"ΔBIC {plain(tried.delta_bic, 3)}"
    yield f"{about.title} ({found.effect}): {explained(about, found.model.isolator.effects[found.effect])}"
    if tried.delta_bic < -DECISIVE:
        yield f"The records ask for it ({bic}, below −{DECISIVE:g})."
    else:
        yield f"The records do not ask for it ({bic}, not below −{DECISIVE:g}): it was added because you said so."
    if tried.implausible:
        yield f"It is implausible: {tried.implausible}."
    yield from gain(found.versions[1], found.versions[2], found.records)
    yield from fit_words(found.fit, found.inflation)
