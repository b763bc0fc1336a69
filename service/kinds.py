"""Which kinds of work there are."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from types import MappingProxyType

from sqlalchemy.orm import Session

from core.analysis import EventAnalysis, analyse
from service import results
from service.jobs import ANALYSE, Claim
from service.results import Inputs
from service.stages import Kind, Stage


def _analysis_stages(inputs: Inputs) -> Sequence[Stage]:
    given = (inputs.segments, inputs.description, inputs.settings)
    return (Stage("Analysing the event", analyse, lambda _: given),)


def _store_analysis(
    session: Session, claim: Claim, inputs: Inputs, found: Sequence[EventAnalysis], now: datetime
) -> None:
    results.store(session, claim, inputs, found[-1], now)


KINDS: Mapping[str, Kind] = MappingProxyType({ANALYSE: Kind(results.inputs, _analysis_stages, _store_analysis)})
"""By the name that a job has."""
