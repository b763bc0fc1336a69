"""Write docs/models/effects.md and its picture from the effects themselves: `python docs/tools/write_effects.py`."""

from collections.abc import Iterator
from pathlib import Path

import altair as alt
import numpy as np

from core.effect import CHANNELS, KINDS, PLACE, Effect, LogNormal, Parameter
from core.effects import EFFECTS
from service.models.effect_loops import ALONE, AMPLITUDE, WITH, WITHOUT, loops, usual_values
from service.models.effects import families, law

PAGE = Path(__file__).parents[1] / "models" / "effects.md"
PICTURE = PAGE.with_suffix(".svg")
OPENING = """\
# The isolator effects

`python docs/tools/write_effects.py` writes this page from the effects themselves. A model of the isolation layer is a
set of effects, each with values for its parameters. All quantities are in SI units.

An effect's law is a function of the motion (`u` m, `v` m/s, `u_cross` and `v_cross` in the other horizontal direction),
of conditions (`axial_load` as a multiple of the dead load, `temperature` °C, `time` s, `ground` for the acceleration of
the ground in m/s²), of the effect's states and parameters, and of the channels that other effects set. It returns the
contribution to the channel that the effect acts on, then the rate of each state. Effects of one family leave similar
traces in records.

{channels}

A force may be of a kind. The scales of the kind multiply it, so that an effect on temperature, load or age acts on
every force of a kind.

{kinds}

A fit leaves a value marked *fixed* as it is, because other values can have the same influence, and also the form of a
law that has *other forms*: a diagnosis tries these where no law in its usual form explains the records. States start
each earthquake at zero. States that are carried on start at zero with the first record, as if the layer were new then,
and keep their values from one earthquake to the next.

The pictures show force in MN against displacement in mm, at the usual values. An effect that adds a force is shown by
itself. For an effect that changes other effects, grey is a yielding layer without it and blue is the layer with it. The
motion grows to 150 mm and decays, the layer also moves in the other direction, the vertical load changes by 20 %, and
the temperature is 0 °C.

![A loop for each effect](effects.svg)
"""
COLUMNS, SIDE = 5, 130
Row = dict[str, float | str]


def document() -> str:
    """The whole page."""
    channels = "\n".join(f"| `{name}` | {channel.meaning} |" for name, channel in CHANNELS.items())
    kinds = "\n".join(f"| `{kind}` | {', '.join(f'`{scale}`' for scale in scales)} |" for kind, scales in KINDS.items())
    opening = OPENING.format(
        channels=f"| channel | meaning |\n|---|---|\n{channels}", kinds=f"| kind | scales |\n|---|---|\n{kinds}"
    )
    sections = (section for family, names in families(EFFECTS).items() for section in _family(family, names))
    return "\n".join([opening, *sections])


def _family(family: str, names: tuple[str, ...]) -> Iterator[str]:
    yield f"## {family[0].upper()}{family[1:]}\n"
    for name in names:
        yield from _section(name, EFFECTS[name])


def _section(name: str, effect: Effect) -> Iterator[str]:
    yield f"### `{name}`: {effect.title}\n"
    explanation = PLACE.sub(r"`\1`", effect.explanation)
    yield f"{explanation}\n\nSuspect it when: {effect.suspect_when}\n\nSource: {effect.source}.\n"
    yield f"```python\n{law(effect).rstrip()}\n```\n"
    yield "| parameter | unit | bounds | usual | meaning |\n|---|---|---|---|---|"
    yield from (_parameter(parameter, effect) for parameter in effect.parameters)
    absent = " and ".join(f"`{key} = {value:g}`" for key, value in effect.absent.items())
    kept = f" It carries {', '.join(f'`{state}`' for state in effect.carried)} on." if effect.carried else ""
    kind = f", of the kind `{effect.kind}`," if effect.kind else ""
    yield f"\nIt acts on `{effect.acts_on}`{kind} and has no influence at {absent}.{kept}\n"


def _parameter(parameter: Parameter, effect: Effect) -> str:
    low, high = parameter.bounds
    spread = parameter.prior.spread
    around = f"×÷ {np.exp(spread):.2g}" if isinstance(parameter.prior, LogNormal) else f"± {spread:.3g}"
    fixed = ", fixed" if parameter.name in effect.held else ""
    if others := effect.forms.get(parameter.name):
        fixed = f"; other forms at {', '.join(f'{one:g}' for one in others)}"
    usual = f"{parameter.prior.median:.3g} {around}"
    return (
        f"| `{parameter.name}` | {parameter.unit} | {low:.3g} ... {high:.3g} | {usual} | {parameter.meaning}{fixed} |"
    )


def rows() -> Iterator[Row]:
    """Points of every panel, in the order in which they are drawn."""
    for name in (name for names in families(EFFECTS).values() for name in names):
        found = loops(name, usual_values(name), AMPLITUDE)
        shown = {WITH: found[ALONE]} if ALONE in found else {way: found[way] for way in (WITHOUT, WITH)}
        for way, (u, force) in shown.items():
            for i in range(0, u.size, 4):
                yield {"effect": name, "way": way, "i": i, "mm": round(1e3 * u[i], 1), "MN": round(force[i] / 1e6, 3)}


def picture() -> alt.FacetChart:
    """Small multiples, one for each effect."""
    points = list(rows())
    lines = (
        alt.Chart(alt.Data(values=points))
        .mark_line(strokeWidth=1)
        .encode(
            alt.X("mm:Q", title="displacement, mm", axis=alt.Axis(values=[-100, 0, 100], grid=False)),
            alt.Y("MN:Q", title="force, MN", axis=alt.Axis(tickCount=4, gridColor="#e6e8eb")),
            alt.Color(
                "way:N",
                title=None,
                scale=alt.Scale(domain=["without", "with"], range=["#b5bac0", "#1f5fa8"]),
                sort=None,
            ),
            alt.Order("i:Q"),
        )
        .properties(width=SIDE, height=SIDE)
    )
    header = alt.Header(title=None, labelFontSize=11, labelFontWeight="bold")
    facet = alt.Facet("effect:N", sort=list(dict.fromkeys(str(row["effect"]) for row in points)), header=header)
    return (
        lines.facet(facet, columns=COLUMNS)
        .resolve_scale(y="independent")
        .configure(font="sans-serif")
        .configure_view(stroke=None)
        .configure_axis(titleFontWeight="normal")
        .configure_legend(orient="top")
    )


def write() -> None:
    """Page and picture."""
    PAGE.write_text(document(), encoding="utf-8")
    picture().save(str(PICTURE))


if __name__ == "__main__":
    write()
