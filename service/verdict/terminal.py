"""An assessment for an engineer at a terminal."""

from collections import defaultdict
from collections.abc import Iterator, Sequence

from rich.console import Group, RenderableType
from rich.text import Text

from service.reports.terminal import folding_table
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
    table = folding_table("check", "value (± 95 %)", "limit", "outcome")
    for check in assessment.checks:
        row = (texts.title(check), texts.value(check), texts.limit(check), check.outcome.value)
        table.add_row(*(Text(cell) for cell in row), style=STYLES[check.outcome])
    yield table
    yield Text("sources of the limits, and what would settle a check", style="bold")
    yield from _grounds(assessment.checks)


def _grounds(checks: Sequence[Check]) -> Iterator[Text]:
    """A line for each source with what would settle checks, and the checks that it is about."""
    about: dict[str, list[str]] = defaultdict(list)
    for check in checks:
        about[_ground(check)].append(texts.title(check))
    for ground, titles in about.items():
        if ground:
            yield Text(f"- {'; '.join(titles)}: {ground}")


def _ground(check: Check) -> str:
    return " ".join(f"{part.removesuffix('.')}." for part in (texts.source(check), check.reason, check.remedy) if part)
