"""Reports and mails in HTML: their templates, and pictures as SVG within the HTML."""

import re
from functools import cache
from pathlib import Path

import altair as alt
import vl_convert
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from service.reports.charts import CONFIG
from service.version import VERSION

STYLE = Path(__file__).parents[1] / "http" / "static" / "menshin.css"

FINER = re.compile(r"(?<=\d\.\d)\d+")
"""Decimals of a coordinate beyond a tenth of a pixel."""
PATH = re.compile(r' d="[^"]*"')
NAMESPACE = re.compile(r' xmlns(:xlink)?="[^"]*"')
"""Namespaces, which HTML implies inside <svg>."""


def rendered(package: str, template: str, **values: object) -> str:
    """A document that needs no other file.

    Args:
        package: its folder `templates` has the template.
        template: name of the file.
        values: what the template shows, besides `version` and `style`.
    """
    own = {"version": VERSION, "style": Markup(STYLE.read_text("utf-8"))}
    return _environment(package).get_template(template).render(**own, **values)


@cache
def _environment(package: str) -> Environment:
    return Environment(
        loader=PackageLoader(package),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def svg(picture: alt.TopLevelMixin, own: str, label: str) -> Markup:
    """The picture, its ids made its own within the page, and its name for those who do not see it.

    Args:
        picture: any of Altair's.
        own: a word that no other picture of the page has, for its ids.
        label: what it shows.
    """
    text = NAMESPACE.sub("", vl_convert.vegalite_to_svg(picture.to_dict(), config=CONFIG))
    text = PATH.sub(lambda path: FINER.sub("", path[0]), text)
    text = text.replace(' id="', f' id="{own}-').replace("url(#", f"url(#{own}-")
    return Markup('<svg role="img" aria-label="{}" ').format(label) + Markup(text.replace("<svg ", "", 1))
