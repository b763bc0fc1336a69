"""Retention: histories of superseded analyses that may be deleted, and their deletion.

Every number of an analysis stays: peaks, modes, cycles and provenance. What goes is its histories, nine tenths of what
it takes, and only of analyses that a later one of their event superseded and that no comparison of a model refers to.
"""

from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np
from sqlalchemy import ColumnElement, Select, exists, func, literal, select, update
from sqlalchemy.orm import Session

from service.analyses.tables import Analysis, DirectionResult, LayerResult
from service.db.blobs import encode
from service.models.tables import ModelComparison
from service.settings import Settings

DELETED = encode(np.zeros(0, np.float32))
"""In place of a history that a direction must have."""
REQUIRED = ("force", "force_rigid", "force_modal", "force_std_history")
OPTIONAL = ("displacement", "velocity", "displacement_std_history", "velocity_std_history")
OF_LAYER = ("torsion", "torsion_std_history", "axial_load")
"""Columns of histories: those that each direction has, those that it may have, and those across directions."""


@dataclass(frozen=True, slots=True)
class Prunable:
    """Histories that the settings allow to delete."""

    analyses: int
    size: int
    """Bytes."""


def prunable(session: Session, settings: Settings, now: datetime) -> Prunable:
    """The histories that `prune` would delete; it reads only."""
    numbers = _superseded(settings, now)
    if numbers is None:
        return Prunable(0, 0)
    of_direction = sum((_size(DirectionResult.__table__.c[name]) for name in (*REQUIRED, *OPTIONAL)), start=_nothing())
    of_layer = sum((_size(LayerResult.__table__.c[name]) for name in OF_LAYER), start=_nothing())
    kept = (DirectionResult.analysis_id.in_(numbers), func.length(DirectionResult.force) > len(DELETED))
    analyses, first = session.execute(
        select(func.count(DirectionResult.analysis_id.distinct()), func.coalesce(func.sum(of_direction), 0)).where(
            *kept
        )
    ).one()
    second = session.scalar(select(func.coalesce(func.sum(of_layer), 0)).where(LayerResult.analysis_id.in_(numbers)))
    return Prunable(analyses, int(first) + int(second or 0))


def prune(session: Session, settings: Settings, now: datetime) -> Prunable:
    """Delete the histories that the settings allow to delete."""
    pruned, numbers = prunable(session, settings, now), _superseded(settings, now)
    if numbers is None or not pruned.analyses:
        return pruned
    directions = dict.fromkeys(REQUIRED, DELETED) | dict.fromkeys(OPTIONAL)
    session.execute(
        update(DirectionResult).where(DirectionResult.analysis_id.in_(numbers)).values(directions),
        execution_options={"synchronize_session": False},
    )
    session.execute(
        update(LayerResult).where(LayerResult.analysis_id.in_(numbers)).values(dict.fromkeys(OF_LAYER)),
        execution_options={"synchronize_session": False},
    )
    return pruned


def _superseded(settings: Settings, now: datetime) -> Select[int] | None:
    """Numbers of the analyses whose histories may go; None where the settings keep everything."""
    age = settings.retention.superseded_histories
    if age is None:
        return None
    is_compared = exists().where(ModelComparison.analysis_id == Analysis.id)
    old = Analysis.created_at < now - timedelta(seconds=age)
    return select(Analysis.id).where(~Analysis.current, old, ~is_compared)


def _size(column: ColumnElement[bytes]) -> ColumnElement[int]:
    return func.coalesce(func.length(column), 0)


def _nothing() -> ColumnElement[int]:
    return literal(0)
