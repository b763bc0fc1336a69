"""The reproduction as one HTML file that needs nothing else: neither a network nor a script."""

from collections.abc import Iterable
from pathlib import Path

from altair import LayerChart
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from service.reports.svg import svg
from service.reproduction.drawing import Figure
from service.reproduction.force_figures import force_figures
from service.reproduction.real import RealBuilding
from service.reproduction.real_figures import real_figures
from service.reproduction.report import Report
from service.reproduction.simulated import Simulated
from service.reproduction.simulated_figures import response_figures
from service.version import VERSION

STYLE = Path(__file__).parents[1] / "http" / "static" / "menshin.css"


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
    return [
        (figure, [_panel(figure.number, number, panel) for number, panel in enumerate(figure.panels)])
        for figure in figures
    ]


def _panel(figure: int, number: int, panel: LayerChart) -> Markup:
    return svg(panel, f"figure-{figure}-{number}", f"Figure {figure}, panel {number + 1}")
