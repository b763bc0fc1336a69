"""Reports and mails in HTML, each one file: templates, and pictures as SVG within the HTML."""

import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from core.tables import Table
from service.documents import still
from service.documents.document import Document, Figure
from service.language.templates import translate
from service.version import VERSION

if TYPE_CHECKING:  # it takes long to import, and most mails have no chart of its
    import altair as alt

STYLE = Path(__file__).parents[1] / "http" / "static" / "menshin.css"

FINER = re.compile(r"(?<=\d\.\d)\d+")
"""Decimals of a coordinate beyond a tenth of a pixel."""
PATH = re.compile(r' d="[^"]*"')
NAMESPACE = re.compile(r' xmlns(:xlink)?="[^"]*"')
"""Namespaces, which HTML implies inside <svg>."""


def page(document: Document) -> str:
    """A report as a file that needs neither a network nor a script."""
    return rendered("documents/templates/document.html", document=document)


def rendered(template: str, **values: object) -> str:
    """A document that needs no other file.

    Args:
        template: path within this package.
        values: what the template shows, besides `version` and `style`.
    """
    own = {"version": VERSION, "style": Markup(STYLE.read_text("utf-8"))}
    return environment().get_template(template).render(**own, **values)


@cache
def environment() -> Environment:
    """The templates of all files, by their path within this package."""
    made = Environment(
        loader=PackageLoader("service", ""),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.tests |= {"table": lambda part: isinstance(part, Table), "figure": lambda part: isinstance(part, Figure)}
    made.globals["drawn"] = _drawn
    translate(made)
    return made


def _drawn(figure: Figure) -> list[Markup]:
    """The pictures of a figure, each with a name of its own."""
    if len(figure.pictures) == 1:
        return [svg(figure.pictures[0], figure.key, figure.title)]
    return [
        svg(picture, f"{figure.key}-{number}", f"{figure.title}, panel {number}")
        for number, picture in enumerate(figure.pictures, start=1)
    ]


def svg(picture: "alt.TopLevelMixin", own: str, label: str) -> Markup:
    """The picture, its ids made its own within the page, and its name for readers who do not see it.

    Args:
        picture: any of Altair's.
        own: a word that no other picture of the page has, for its ids.
        label: contents of the picture.
    """
    from service.documents.charts import CONFIG

    return own_ids(still.svg(picture.to_dict(), CONFIG), own, label)


def own_ids(drawn: str, own: str, label: str) -> Markup:
    """A picture that is SVG already, likewise."""
    text = NAMESPACE.sub("", drawn)
    text = PATH.sub(lambda path: FINER.sub("", path[0]), text)
    text = text.replace(' id="', f' id="{own}-').replace("url(#", f"url(#{own}-")
    return Markup('<svg role="img" aria-label="{}" ').format(label) + Markup(text.replace("<svg ", "", 1))
