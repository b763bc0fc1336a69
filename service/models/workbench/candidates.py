"""Which effects were tried, and what does each make of every earthquake?"""

from collections.abc import Mapping
from dataclasses import dataclass

from core.comparison.compared import compare_forces, force_misfit
from core.comparison.misfit import Misfit
from core.diagnosis.plausibility import implausible
from core.diagnosis.ranking import Dropped, Judged, Ranking
from core.effects import EFFECTS
from core.errors import ModelError
from core.fitting.fit import Fit
from service.models.workbench.records import Records
from service.models.workbench.refit import deviations
from service.models.workbench.versions import FITTED, LEFT_OUT, groups


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """An effect that was tried."""

    effect: str
    fit: Fit
    delta_bic: float
    """Below -10: the records ask for it."""
    in_set: bool
    """Whether it is the best, or the records cannot distinguish it from the best, and nothing speaks against it."""
    after: Misfit
    """N, of the force, where it was fitted."""
    floors: float
    """What is left in multiples of the noise floor, each earthquake in its own, as the ranking has it."""
    after_left_out: Misfit | None
    implausible: str | None
    """Why a layer cannot be so."""
    deviations: Mapping[str, float]
    """Of its own parameters."""

    @property
    def family(self) -> str:
        """Its effect's."""
        return EFFECTS[self.effect].family


def candidates(ranking: Ranking, records: Records) -> tuple[tuple[Candidate, ...], tuple[Dropped, ...]]:
    """All that were tried, each on every earthquake, the best first; and those whose force diverged in one of them."""
    alike = {one.effect for one in ranking.asked_for}
    tried, dropped = [], []
    for one in ranking.candidates:
        try:
            tried.append(_candidate(one, ranking, records, one.effect in alike))
        except ModelError as error:
            dropped.append(Dropped(one.effect, str(error)))
    return tuple(tried), tuple(dropped)


def _candidate(judged: Judged, ranking: Ranking, records: Records, in_set: bool) -> Candidate:
    parted, model = groups(records), judged.fit.model
    forces = compare_forces(model, records.observations, records.band)
    errors = {
        group: force_misfit([one for one in forces if one.observation.name in names]) for group, names in parted.items()
    }
    against = implausible(judged.effect, judged.fit, records.fitted)
    return Candidate(
        effect=judged.effect,
        fit=judged.fit,
        delta_bic=judged.delta_bic,
        in_set=in_set and against is None,
        after=errors[FITTED],
        floors=ranking.over_floor(judged.fit),
        after_left_out=errors.get(LEFT_OUT),
        implausible=against,
        deviations=deviations(judged.fit, ranking.inflation).get(judged.effect, {}),
    )
