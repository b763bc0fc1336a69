"""An assessment as parts of a report, for an engineer."""

from collections import defaultdict
from collections.abc import Iterator, Sequence

from core.tables import Table
from service.documents.document import Part, Text, heading, paragraph
from service.verdict import texts
from service.verdict.assessment import Assessment
from service.verdict.checks import Check


def parts(assessment: Assessment) -> Iterator[Part]:
    """The verdict and its checks, each with its limit and what it rests on."""
    yield heading(f"verdict: {texts.headline(assessment)}")
    yield paragraph([" ".join(texts.opening(assessment))])
    if assessment.alerts:
        yield paragraph(
            f"alert {alert.id}, {texts.STATE_NAMES.get(alert.state, alert.state)}: {alert.summary}"
            for alert in assessment.alerts
        )
    if not assessment.checks:
        return
    headings = ("check", "value (± 95 %)", "limit", "outcome")
    rows = (
        (texts.title(check), texts.value(check), texts.limit(check), check.outcome.value) for check in assessment.checks
    )
    yield Table("", headings, tuple(rows), texts=headings)
    yield heading("sources of the limits, and what would settle a check")
    yield _grounds(assessment.checks)


def _grounds(checks: Sequence[Check]) -> Text:
    """Each source, with what would settle checks, after the checks that it is about."""
    about: dict[str, list[str]] = defaultdict(list)
    for check in checks:
        about[_ground(check)].append(texts.title(check))
    return paragraph(f"- {'; '.join(titles)}: {ground}" for ground, titles in about.items() if ground)


def _ground(check: Check) -> str:
    return " ".join(f"{part.removesuffix('.')}." for part in (texts.source(check), check.reason, check.remedy) if part)
