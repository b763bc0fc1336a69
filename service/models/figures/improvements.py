"""Figure of an improvement: the error in earthquakes that the model was not fitted to, after each change."""

from collections.abc import Iterator, Sequence

import altair as alt

from core.workbench.improving import BEFORE, STRONGER
from service.documents.charts import BLUE, GREY, INK, ORANGE, WIDTH, brief, curves, shown_on_hover, values
from service.documents.document import Figure, Rows, numbers
from service.models import texts
from service.models.results import LeftOut

HEIGHT = 300
"""Pixels."""
ERROR = "error (% of the force)"
PERCENT = 100.0
COLOURS = (BLUE, GREY, INK)
"""Colours of the earthquakes left out, in their order; of more than these, one line shows all."""
ALL = "all left out in turn"


def left_out_figure(steps: Sequence[LeftOut], width: int = WIDTH) -> Figure:
    """Error in each earthquake left out, and in stronger ones by the model fitted to weaker ones, over the changes.

    Args:
        steps: the model before and after each change.
        width: pixels of the picture.
    """
    names = list(steps[0].errors) if len(steps[0].errors) <= len(COLOURS) else []
    rows: Rows = list(_rows(steps, names))
    shown = dict(zip(names, COLOURS, strict=False)) or {ALL: BLUE}
    colours = {**({STRONGER: ORANGE} if any(row["curve"] == STRONGER for row in rows) else {}), **shown}
    across = alt.X("step:O", sort=None, title="change", axis=alt.Axis(labelAngle=-40, labelLimit=220))
    up = alt.Y("y:Q", title=ERROR).scale(zero=True)
    hover = [
        alt.Tooltip("curve:N", title="earthquake"),
        *shown_on_hover(y=ERROR),
        alt.Tooltip("step:O", title="change"),
    ]
    base = alt.Chart(values(rows)).encode(across, up, color=curves(colours), tooltip=hover)
    layers = [base.mark_line(strokeWidth=1.8), base.mark_point(filled=True, size=40, opacity=1.0)]
    title, caption = texts.FIGURES["left_out"]
    picture = alt.LayerChart(layer=layers, width=width, height=HEIGHT)
    return Figure("left_out", title, caption, (picture,), numbers(rows))


def _rows(steps: Sequence[LeftOut], names: Sequence[str]) -> Iterator[dict[str, object]]:
    for number, step in enumerate(steps):
        change = f"{number} {_change(step)}"
        each = {name: step.errors.get(name) for name in names} or {ALL: step.error}
        for name, error in {STRONGER: step.error_in_stronger, **each}.items():
            if error is not None:
                yield {"curve": name, "step": change, "y": brief(PERCENT * error)}


def _change(step: LeftOut) -> str:
    if step.effect is None:
        return BEFORE
    return f"+ {step.effect}" if step.added else f"− {step.effect}"
