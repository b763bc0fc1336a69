"""What the API says of a diagnosis."""

from typing import Any

from service.models.diagnosis_schema import DiagnosisOut, DiagnosisRow
from service.models.tables import ModelDiagnosis

ITEMS = ("findings", "candidates", "set", "unknown_flag", "unexplained", "steps", "versions", "unused")
"""Of the document that is kept."""


def row(found: ModelDiagnosis) -> DiagnosisRow:
    """A diagnosis as a list has it."""
    return DiagnosisRow(**_row(found))


def whole(found: ModelDiagnosis) -> DiagnosisOut:
    """A diagnosis and all that it found."""
    dropped = found.document.get("dropped", [])  # earlier versions of the code did not keep any
    return DiagnosisOut(**_row(found), dropped=dropped, **{name: found.document[name] for name in ITEMS})


def _row(found: ModelDiagnosis) -> dict[str, Any]:
    same = ("id", "outcome", "fitted", "left_out", "analyses", "revision_id", "author", "created_at", "version")
    return {name: getattr(found, name) for name in same} | {
        "model": found.model_id,
        "explanation": " ".join(found.sentences),
        "job": found.job_id,
    }
