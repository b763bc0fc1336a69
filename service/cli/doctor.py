"""`menshin doctor`: what is wrong with the installation, and what helps."""

import json
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.inputs import current_settings

if TYPE_CHECKING:
    from service.doctor.findings import Finding

app = typer.Typer()


@app.command()
def doctor(
    timeout: Annotated[
        float,
        typer.Option(
            min=0.1, max=600, help="Seconds allowed for the database, and then for all other checks together."
        ),
    ] = 10.0,
    only: Annotated[
        list[str] | None,
        typer.Option(
            metavar="CHECK", help="Run only this check, besides those of settings and database; may be repeated."
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the findings as JSON.")] = False,
) -> None:
    """Examine the installation, and say what is wrong and what helps.

    The checks: settings, database, disk, clock, poller, worker, notifier, api, mail, sources, keys and recipients.
    Nothing is changed and nothing is sent. The exit code is 0 if nothing is wrong, 1 if something is wrong or could not
    be examined, 2 if the settings cannot be read.
    """
    from service.doctor.examination import FURTHER, examine
    from service.doctor.findings import State

    if unknown := sorted({*(only or ())} - {*FURTHER}):
        raise typer.BadParameter(
            f"{unknown[0]!r} is not a check; the checks are {', '.join(FURTHER)}", param_hint="--only"
        )
    findings = examine(current_settings(), timeout, tuple(only or ()))
    is_well = all(one.state in (State.GOOD, State.NOTE) for one in findings)
    if as_json:
        items = [{"check": f.check, "state": f.state, "found": f.found, "helps": f.helps or None} for f in findings]
        typer.echo(json.dumps({"is_well": is_well, "findings": items}, indent=2, ensure_ascii=False))
    else:
        _print(findings)
    raise typer.Exit(0 if is_well else 1)


def _print(findings: "tuple[Finding, ...]") -> None:
    from service.documents.text import print_table

    rows, previous = [], ""
    for one in findings:
        name = "" if one.check == previous else one.check
        rows.append((name, one.state, one.found, one.helps))
        previous = one.check
    print_table(("check", "state", "found", "what helps"), rows)
