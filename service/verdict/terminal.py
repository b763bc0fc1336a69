"""An assessment for an engineer at a terminal."""

from collections.abc import Iterator

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from service.verdict import texts
from service.verdict.assessment import Assessment
from service.verdict.checks import Check, Outcome

STYLES = {Outcome.EXCEEDED: "bold red", Outcome.UNDECIDED: "yellow", Outcome.PASSED: ""}


def checks(assessment: Assessment) -> RenderableType:
    """The verdict and its checks, each with its limit and what it rests on."""
    return Group(*_parts(assessment))


def _parts(assessment: Assessment) -> Iterator[RenderableType]:
    yield Text(f"\nverdict: {texts.headline(assessment)}", style="bold")
    yield Text(" ".join(texts.opening(assessment)))
    for alert in assessment.alerts:
        yield Text(f"alert {alert.id}, {texts.STATE_NAMES.get(alert.state, alert.state)}: {alert.summary}")
    if not assessment.checks:
        return
    table = Table("check", "value (± 95 %)", "limit", "outcome", "source of the limit, and what would settle it")
    for check in assessment.checks:
        row = (texts.title(check), texts.value(check), texts.limit(check), check.outcome.value, _ground(check))
        table.add_row(*(Text(cell) for cell in row), style=STYLES[check.outcome])
    yield table


def _ground(check: Check) -> str:
    settles = (check.reason, check.remedy) if check.outcome is Outcome.UNDECIDED else ()
    return " ".join(part for part in (texts.source(check), *settles) if part)
