"""Still pictures of charts, in the language of their readers."""

from collections.abc import Mapping
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import vl_convert

from service.documents.translated import TIMES, Spec, translated
from service.language.choice import spoken

FONTS: Mapping[str, str] = {"fontpkg_source_sans_3": "files", "matplotlib_fontja": "fonts"}
"""Folder of fonts by package: Latin letters, Japanese ones. The packages are not imported."""


def svg(spec: Spec, config: Mapping[str, Any] | None = None) -> str:
    """A chart as SVG.

    Args:
        spec: of Vega-Lite, in English.
        config: what applies where the specification says nothing else.
    """
    _know_fonts()
    drawn: str = vl_convert.vegalite_to_svg(
        translated(spec), config=None if config is None else dict(config), time_format_locale=TIMES.get(spoken())
    )
    return drawn


def png(spec: Spec, scale: float) -> bytes:
    """The same as PNG, with so many pixels for one of the chart's."""
    _know_fonts()
    drawn: bytes = vl_convert.vegalite_to_png(translated(spec), scale=scale, time_format_locale=TIMES.get(spoken()))
    return drawn


def font_folders() -> list[Path]:
    """Folders of the fonts that come with this program, so that all machines draw alike."""
    specs = ((find_spec(package), folder) for package, folder in FONTS.items())
    return [Path(place) / folder for spec, folder in specs if spec for place in spec.submodule_search_locations or ()]


@cache
def _know_fonts() -> None:
    """Let labels be placed by the width of the letters with which they are shown."""
    for folder in font_folders():
        vl_convert.register_font_directory(str(folder))
