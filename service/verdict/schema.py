"""The verdict for programs, in SI units: one schema for the API, CloudEvents, files and reports."""

from datetime import datetime
from math import isfinite
from typing import Any

from pydantic import Field

from service.schema import Answer, Number
from service.verdict import texts
from service.verdict.assessment import Assessment, OpenAlert, SignedInspection
from service.verdict.checks import Check


class CheckOut(Answer):
    """A check against limits."""

    name: str = Field(
        description="`shear_strain`, `design_displacement`, `moat_clearance`, `residual_displacement`, "
        "`rest_position`, `damper_stroke`, `damper_travel`, `storey_drift`, `floor_acceleration`, `jma_intensity`, "
        "`long_period_class`, `largest_so_far`, `stiffness`, `data_quality`, `sensor_health` or `clock_health`."
    )
    direction: str | None = Field(description="x or y; null where the check is about the whole layer, or the records.")
    outcome: str = Field(description="`passed`, `exceeded` or `undecided`.")
    level: str = Field(description="Level of the verdict that the check alone leads to.")
    unit: str = Field(description="SI unit of value and limits: `1`, `m`, `m/s` or `m/s²`.")
    value: Number | None = Field(description="Null where it is not known.")
    uncertainty: Number | None = Field(description="95 %; null where it is not known.")
    limit: Number | None = Field(description="The limit that decides; null where there is none.")
    limits: dict[str, Number] | None = Field(description="By the level that each leads to; null where there is none.")
    source: str | None = Field(description="Source of the limits; null where there is none.")
    note: str = Field(description="Place of the value, or how far its determination goes; mostly empty.")
    reason: str = Field(
        description="What is unclear: of an exceeded check, whether a graver limit is exceeded too. Empty: nothing is."
    )
    remedy: str = Field(description="What settles it; empty where nothing is unclear.")


class OpenAlertOut(Answer):
    """An open alert that the verdict counts."""

    id: int = Field(description="Its number.")
    cause: str = Field(description="Its subject, such as `stiffness` or `source`.")
    kind: str = Field(description="`deterioration`, `limit`, `recovery`, `sensor`, `model` or `data`.")
    state: str = Field(description="`pending`, `on_hold`, `active` or `acknowledged`.")
    summary: str = Field(description="One line for readers who are not engineers.")
    level: str = Field(description="Level of the verdict that the alert alone leads to.")
    rests_here: bool = Field(description="True if its evidence includes the earthquake.")
    is_of_another: bool = Field(
        description="True if its evidence includes the earthquake, and the value in its summary is that of another."
    )
    is_later: bool = Field(description="True if it began after the earthquake.")


class SignedInspectionOut(Answer):
    """The latest inspection of the building."""

    by: str = Field(description="Person who signed it.")
    at: datetime = Field(description="Time when it was made.")
    result: str = Field(description="`fit` (for normal use), `restricted` or `unfit`.")
    comment: str = Field(description="Findings and restrictions.")
    level: str = Field(description="Automatic level when it was recorded.")
    covers: bool = Field(description="True if it was made after the last earthquake.")


class VerdictOut(Answer):
    """The verdict with everything that it rests on; automatic, and no inspection."""

    level: str = Field(
        description="`act`, `inspect`, `no_data`, `undecided`, `watch` or `normal`. `normal` only where every check "
        "passed, the result is final and no alert is open."
    )
    automatic_level: str = Field(description="The level without the inspection.")
    inspection: SignedInspectionOut | None = Field(
        description="The latest one, in the verdict on a building; null where there is none, and on an earthquake."
    )
    headline: str = Field(description="The verdict and its first reason, one line.")
    sentences: list[str] = Field(description="The verdict with everything that weakens it.")
    is_provisional: bool = Field(description="True if the result is not final.")
    unseen: str = Field(
        description="Earlier earthquakes without a usable record and without an inspection since, which keep a "
        "building undecided; empty where there are none, and in the verdict on an earthquake."
    )
    is_beyond_history: bool = Field(
        description="True if the isolators moved farther than, or not surely less than, in any earlier earthquake."
    )
    checks: list[CheckOut] = Field(description="Empty where there is no usable record.")
    open_alerts: list[OpenAlertOut] = Field(description="Active ones first.")


def verdict_out(assessment: Assessment) -> VerdictOut:
    """An assessment in the schema of the verdict; docs/operate/verdict.md explains each value."""
    return VerdictOut(
        level=assessment.level.value,
        automatic_level=assessment.automatic.value,
        inspection=None if assessment.inspection is None else _inspection_out(assessment.inspection),
        headline=texts.headline(assessment),
        sentences=list(texts.sentences(assessment)),
        is_provisional=bool(assessment.provisional),
        unseen=assessment.unseen,
        is_beyond_history=assessment.is_beyond_history,
        checks=[_check_out(check) for check in assessment.checks],
        open_alerts=[_alert_out(alert) for alert in assessment.alerts],
    )


def verdict_json(assessment: Assessment) -> dict[str, Any]:
    """The same as JSON values."""
    return verdict_out(assessment).model_dump(mode="json")


def _inspection_out(one: SignedInspection) -> SignedInspectionOut:
    return SignedInspectionOut(
        by=one.by, at=one.at, result=one.result.value, comment=one.comment, level=one.level.value, covers=one.covers
    )


def _check_out(check: Check) -> CheckOut:
    u = check.uncertainty
    return CheckOut(
        name=check.name,
        direction=check.subject or None,
        outcome=check.outcome.value,
        level=check.level.value,
        unit=check.unit,
        value=check.value,
        uncertainty=u if u is not None and isfinite(u) else None,  # JSON has no infinity
        limit=check.limit,
        limits=None if check.limits is None else {str(level): limit for level, limit in check.limits},
        source=None if check.limits is None else check.limits.source,
        note=check.note,
        reason=check.reason,
        remedy=check.remedy,
    )


def _alert_out(alert: OpenAlert) -> OpenAlertOut:
    return OpenAlertOut(
        id=alert.id,
        cause=alert.cause,
        kind=alert.kind,
        state=alert.state,
        summary=alert.summary,
        level=alert.level.value,
        rests_here=alert.rests_here,
        is_of_another=alert.is_of_another,
        is_later=alert.is_later,
    )
