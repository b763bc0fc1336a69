"""The reproduction as one HTML file that needs nothing else: neither a network nor a script."""

import re
from collections.abc import Iterable
from pathlib import Path

import vl_convert
from altair import LayerChart
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from service.charts import CONFIG
from service.reproduction.drawing import Figure
from service.reproduction.force_figures import force_figures
from service.reproduction.real import RealBuilding
from service.reproduction.real_figures import real_figures
from service.reproduction.report import Report
from service.reproduction.simulated import Simulated
from service.reproduction.simulated_figures import response_figures
from service.version import VERSION

STYLE = Path(__file__).parents[1] / "pages" / "static" / "menshin.css"
FINER = re.compile(r"(?<=\d\.\d)\d+")
"""What a coordinate has beyond a tenth of a pixel."""
PATH = re.compile(r' d="[^"]*"')
NAMESPACE = re.compile(r' xmlns(:xlink)?="[^"]*"')
"""Which HTML gives to what is inside <svg> by itself."""


def page(report: Report, simulated: Simulated, real: RealBuilding | None) -> str:
    """Tables, remarks and figures."""
    figures = ((*response_figures(simulated), *force_figures(simulated)), () if real is None else real_figures(real))
    environment = Environment(
        loader=PackageLoader("service.reproduction"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("reproduction.html").render(
        opening=report.opening,
        version=VERSION,
        style=Markup(STYLE.read_text("utf-8")),
        sections=[(section, _with_svgs(some)) for section, some in zip(report.sections, figures, strict=True)],
    )


def _with_svgs(figures: Iterable[Figure]) -> list[tuple[Figure, list[Markup]]]:
    return [(figure, [_svg(figure.number, *panel) for panel in enumerate(figure.panels)]) for figure in figures]


def _svg(figure: int, number: int, panel: LayerChart) -> Markup:
    """The panel, its ids made its own within the page, and its name for those who do not see it."""
    svg = NAMESPACE.sub("", vl_convert.vegalite_to_svg(panel.to_dict(), config=CONFIG))
    svg = PATH.sub(lambda path: FINER.sub("", path[0]), svg)
    own = f"figure-{figure}-{number}-"
    svg = svg.replace(' id="', f' id="{own}').replace("url(#", f"url(#{own}")
    return Markup(svg.replace("<svg ", f'<svg role="img" aria-label="Figure {figure}, panel {number + 1}" ', 1))
