"""The tables: what was received, what came of it, and who may see it.

All of them are imported here, for SQLAlchemy finds a table by name only once its module is.
"""

from service.database.alerts import Alert, AlertChange, Inspection, Silence
from service.database.analyses import Analysis, CycleResult, DirectionResult, LayerResult, ModeResult, SensorResult
from service.database.audit import AuditEntry
from service.database.base import Base
from service.database.buildings import Building, Revision
from service.database.diagnoses import DiagnosisPicture, ModelDiagnosis
from service.database.events import Event, EventRecording, Waveform
from service.database.jobs import Job, Lease
from service.database.keys import ApiKey, LoginLink, LoginSession
from service.database.models import ModelComparison, ModelVersion
from service.database.notices import Delivery, DeliveryAttempt, Message, Receiver
from service.database.received import Content, FetchedFile, Recording, SourceState
from service.database.watching import DriftAlarm, DriftValue, ReferencePeriod, WatchedSeries

__all__ = [
    "Alert",
    "AlertChange",
    "Analysis",
    "ApiKey",
    "AuditEntry",
    "Base",
    "Building",
    "Content",
    "CycleResult",
    "Delivery",
    "DeliveryAttempt",
    "DiagnosisPicture",
    "DirectionResult",
    "DriftAlarm",
    "DriftValue",
    "Event",
    "EventRecording",
    "FetchedFile",
    "Inspection",
    "Job",
    "LayerResult",
    "Lease",
    "LoginLink",
    "LoginSession",
    "Message",
    "ModeResult",
    "ModelComparison",
    "ModelDiagnosis",
    "ModelVersion",
    "Receiver",
    "Recording",
    "ReferencePeriod",
    "Revision",
    "SensorResult",
    "Silence",
    "SourceState",
    "WatchedSeries",
    "Waveform",
]
