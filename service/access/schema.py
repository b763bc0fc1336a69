"""The audit trail in the API."""

from datetime import datetime
from typing import Any

from pydantic import Field

from service.schema import Answer, Page


class AuditRow(Answer):
    """A change that a person made."""

    id: int = Field(description="Its number.")
    at: datetime = Field(description="When.")
    by: str = Field(description="Name of the key, or of the account that ran the command.")
    address: str = Field(description="Address of the client, or name of the machine.")
    action: str = Field(description="Method of the request, or the command.")
    target: str = Field(description="Path of the request; empty for a command.")
    details: dict[str, Any] = Field(description="Parameters of the request, without secrets.")


class Audit(Page[AuditRow]):
    """A page of the audit trail, the latest first."""
