"""What is the model after each of the effects that were asked for?"""

from collections.abc import Sequence
from dataclasses import dataclass

from core.diagnosis.missing_effects import Diagnosis, Step
from core.fitting.fit import Fit
from core.fitting.weighed_fit import weighed_fit
from core.model.isolator import Isolator
from service.models.workbench.records import Records


@dataclass(frozen=True, slots=True, eq=False)
class Stage:
    """The model with the first effects that were asked for."""

    effect: str
    """The last one of them."""
    step: Step
    """Against which others it was chosen."""
    fit: Fit
    inflation: float
    """Of its variances, see service.models.workbench.refit.Refit."""


def stages(found: Diagnosis, records: Records) -> tuple[Stage, ...]:
    """The model with the first of the effects, the first two of them ... and all.

    Where an effect took another's place the models before it never were: they are fitted here.
    """
    added: list[str] = []
    made: list[Stage] = []
    for step in found.steps:
        added.append(step.chosen.effect)
        wanted = {*found.given.effects, *added}
        if set(step.chosen.fit.model.effects) == wanted:
            fit, inflation = step.chosen.fit, step.ranking.inflation
        else:
            whole = found.after.model.effects
            own = weighed_fit(records.fitted, Isolator({n: v for n, v in whole.items() if n in wanted}))
            fit, inflation = own.fit, own.inflation
        made.append(Stage(step.chosen.effect, step, fit, inflation))
    return tuple(made)


def named(staged: Sequence[Stage]) -> str:
    """Of a version, by what was added."""
    return f"with {', '.join(stage.effect for stage in staged)}"
