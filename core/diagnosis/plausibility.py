"""Could a layer have an effect with the values that a fit gave it?

Nothing is dropped for being implausible: an engineer should see what the records ask for, and why it cannot be so.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from core.effects import EFFECTS
from core.fitting.descent import Outcome
from core.fitting.fit import Fit
from core.fitting.observation import Observation
from core.fitting.projected_misfit import parameter
from core.model.driven import force_history
from core.model.isolator import Isolator

FED = 0.05
"""Of the work that passes through the layer: what a force may feed into the motion for its numerical error."""


def implausible(effect: str, fit: Fit, observations: Sequence[Observation]) -> str | None:
    """Why not, in words; None if nothing speaks against it.

    Args:
        effect: of the model.
        fit: of the model with it.
        observations: the records.
    """
    return next(_reasons(effect, fit, observations), None)


def _reasons(effect: str, fit: Fit, observations: Sequence[Observation]) -> Iterator[str]:
    values, about = fit.model.effects[effect], EFFECTS[effect]
    if about.linear and all(values[name] == 0 for name in about.linear):
        yield "it has no strength left: the records ask for the opposite of it"
    searched = [] if fit.outcome is Outcome.STOPPED else [name for name in values if (effect, name) in fit.free]
    for one in (parameter((effect, name)) for name in searched if name not in about.linear):
        if values[one.name] in one.bounds:
            side = "smallest" if values[one.name] == one.bounds[0] else "largest"
            yield f"{one.name} went to the {side} that it may be ({one.meaning})"
    # an instant between two earthquakes need not be known any better
    lost = [name for of, name in fit.undetermined if of == effect and not parameter((of, name)).is_instant]
    if lost:
        yield f"the records do not determine {', '.join(lost)}"
    fed = [one for one in observations if _work(fit.model, one) < 0]
    if fed:
        yield f"the layer would feed energy into the motion in the earthquake of {fed[0].name}"


def _work(model: Isolator, observation: Observation) -> float:
    """J, that the layer takes up, and a little more for what is numerical: below 0 it gives."""
    layer = observation.layer
    force = force_history(model, layer.displacement, layer.velocity, observation.rate, observation.conditions)
    power = force * layer.velocity
    return float(np.sum(power) + FED * np.sum(np.abs(power))) / observation.rate
