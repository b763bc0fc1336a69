"""What the workbench found, as one HTML file that needs nothing else: neither a network nor a script."""

from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from service.models.workbench.errors_table import force_errors, levels_of, predicted_errors
from service.models.workbench.figure import Figure
from service.models.workbench.figures.corrections import stiffness_over_amplitude, yield_over_travel
from service.models.workbench.figures.histories import histories, loop, strongest_of
from service.models.workbench.figures.profiles import shares
from service.models.workbench.figures.residual import over_motion, spectrum
from service.models.workbench.held import Held
from service.models.workbench.values import values_of
from service.reports.svg import svg
from service.version import VERSION

STYLE = Path(__file__).parents[2] / "http" / "static" / "menshin.css"


def page(found: Held) -> str:
    """Text, tables and pictures of a comparison."""
    figures = comparison_figures(found)
    return rendered(
        "comparison.html",
        found=found,
        values=list(values_of(found.model)),
        tables=[table for table in (force_errors(found), predicted_errors(found, levels_of(found))) if table],
        figures=[(figure, svg(figure.picture, figure.key, figure.title)) for figure in figures],
    )


def comparison_figures(found: Held) -> list[Figure]:
    """Those that need no candidates."""
    strongest = strongest_of(found.answers.forces)
    shown = found.answers.of([strongest[0].observation.name])
    drawn = (
        stiffness_over_amplitude(found.corrections),
        loop(strongest),
        over_motion(found.answers.forces),
        yield_over_travel(found.corrections),
        None if found.failure.is_noise else shares(found.failure.profiles),
        spectrum(found.answers.forces, found.records.band),
        histories(shown.forces, shown.predictions),
    )
    return [figure for figure in drawn if figure is not None]


def rendered(template: str, **values: object) -> str:
    """A page of the workbench's, from its template."""
    environment = Environment(
        loader=PackageLoader("service.models.workbench"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    own = {"version": VERSION, "style": Markup(STYLE.read_text("utf-8"))}
    return environment.get_template(template).render(**own, **values)
