"""A picture as part of a page: SVG that lies in the HTML."""

import re

import altair as alt
import vl_convert
from markupsafe import Markup

from service.reports.charts import CONFIG

FINER = re.compile(r"(?<=\d\.\d)\d+")
"""Decimals of a coordinate beyond a tenth of a pixel."""
PATH = re.compile(r' d="[^"]*"')
NAMESPACE = re.compile(r' xmlns(:xlink)?="[^"]*"')
"""Namespaces, which HTML implies inside <svg>."""


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
