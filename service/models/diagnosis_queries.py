"""What is asked about the diagnoses of models."""

from collections.abc import Sequence

from sqlalchemy import select
from sqlalchemy.orm import Session, joinedload, selectinload, undefer

from service.errors import NotFoundError
from service.models.tables import DiagnosisPicture, ModelDiagnosis, ModelVersion


def diagnoses(session: Session, model_id: int, before: int | None, limit: int) -> Sequence[ModelDiagnosis]:
    """Of a version, the latest first; `before` is the id at which the page before ended."""
    question = select(ModelDiagnosis).where(ModelDiagnosis.model_id == model_id)
    if before is not None:
        question = question.where(ModelDiagnosis.id < before)
    return session.scalars(question.order_by(ModelDiagnosis.id.desc()).limit(limit)).all()


def diagnosis(session: Session, identity: int) -> ModelDiagnosis:
    """A diagnosis with its model and all that it found; its pictures are named.

    Raises:
        NotFoundError: there is none by that number.
    """
    question = select(ModelDiagnosis).options(
        undefer(ModelDiagnosis.document),
        selectinload(ModelDiagnosis.pictures),
        joinedload(ModelDiagnosis.model).joinedload(ModelVersion.building),
    )
    found = session.scalars(question.where(ModelDiagnosis.id == identity)).one_or_none()
    if found is None:
        raise NotFoundError("diagnosis", identity)
    return found


def picture(session: Session, identity: int) -> str:
    """A picture of a diagnosis as SVG.

    Raises:
        NotFoundError: there is none by that number.
    """
    found = session.scalar(select(DiagnosisPicture.svg).where(DiagnosisPicture.id == identity))
    if found is None:
        raise NotFoundError("picture", identity)
    return found
