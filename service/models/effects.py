"""Descriptions of effects for engineers, for terminal, API and page: action, signs, law and parameters."""

from collections.abc import Iterator, Mapping
from inspect import getsource
from itertools import groupby

from rich.console import Group, RenderableType
from rich.syntax import Syntax
from rich.table import Table as RichTable
from rich.text import Text

from core.effect import Effect, Parameter, explained
from core.tables import Table
from service.documents.text import table as drawn


def families(effects: Mapping[str, Effect]) -> dict[str, tuple[str, ...]]:
    """Names of the effects by family, both in alphabetical order."""
    named = sorted(effects, key=lambda name: (effects[name].family, name))
    return {family: tuple(names) for family, names in groupby(named, key=lambda name: effects[name].family)}


def law(effect: Effect) -> str:
    """Source of its law, which is its formula."""
    return getsource(effect.law)


def overview(effects: Mapping[str, Effect]) -> RenderableType:
    """A table of all, by family: effects of one family leave similar traces in records."""
    table = RichTable()
    for heading in ("effect", "suspect it when"):
        table.add_column(heading, overflow="fold")
    for family, names in families(effects).items():
        table.add_row(Text(family, style="bold"), "")
        for name in names:
            called = Text(f"{name}\n").append(effects[name].title, style="dim")
            table.add_row(called, Text(effects[name].suspect_when), end_section=name == names[-1])
    return table


def sheet(name: str, effect: Effect) -> RenderableType:
    """One effect, in full."""
    return Group(*_parts(name, effect))


def _parts(name: str, effect: Effect) -> Iterator[RenderableType]:
    yield Text(f"{name}: {effect.title} (family {effect.family})", style="bold")
    yield Text(f"\n{explained(effect, None)}\nSuspect it when: {effect.suspect_when}\nSource: {effect.source}\n")
    yield drawn(_parameters(effect.parameters))
    absent = " and ".join(f"{key} = {value:g}" for key, value in effect.absent.items())
    kind = f", of the kind {effect.kind}" if effect.kind else ""
    yield Text(f"It has no influence at {absent}. It acts on: {effect.acts_on}{kind}.")
    if effect.carried:
        yield Text(f"The layer keeps {', '.join(effect.carried)} from one earthquake to the next.")
    yield Text("\nIts law in terms of the motion (u in m, v in m/s): the added force, then the rates of its states:\n")
    yield Syntax(law(effect), "python", background_color="default", word_wrap=True)


def _parameters(parameters: tuple[Parameter, ...]) -> Table:
    headings = ("parameter", "unit", "bounds", "usual", "meaning")
    rows = (
        (one.name, one.unit, "{:g} ... {:g}".format(*one.bounds), f"{one.prior.median:g}", one.meaning)
        for one in parameters
    )
    return Table("", headings, tuple(rows), texts=headings)
