"""Pages for paper: a template of Typst and its data become a PDF, or pictures of its pages.

Data reach the template as JSON and are never part of its markup. A template reads no file of this machine: its folder
is an empty one, and packages are looked up there alone.
"""

import json
from collections.abc import Mapping
from datetime import datetime
from functools import cache
from tempfile import TemporaryDirectory
from typing import Any, Literal

import typst

from service.documents.still import font_folders
from service.language.choice import spoken
from service.language.templates import marked
from service.language.translation import gettext

STANDARDS = ("a-2a", "ua-1")
"""PDF/A for archives (ISO 19005-2), PDF/UA for readers who do not see it (ISO 14289-1)."""
PRELUDE = """
#let language = sys.inputs.language
#let texts = json(bytes(sys.inputs.texts))
#let t(message, ..places) = {
  let text = texts.at(message)
  for (name, value) in places.named() {
    text = text.split("{" + name + "}").join(value)
  }
  text
}
"""
"""Variables of every template: the language, and the texts in it; a last place may have content."""
SHARPNESS = 120.0
"""Pixels per inch of a picture of a page."""


def pdf(template: str, data: Mapping[str, Any], issued: datetime) -> bytes:
    """The document of a template as PDF, for archives and screen readers where its letters allow it.

    Args:
        template: text of the template; it reads the data as JSON from `sys.inputs.data`, and marks its texts by `t`.
        data: values of JSON.
        issued: time of the document, aware; the same data and time give the same bytes.
    """
    options = {"timestamp": int(issued.timestamp())}
    try:
        made = _compiled(template, data, "pdf", pdf_standards=list(STANDARDS), **options)
    except typst.TypstError:  # a letter that no font has, say: then it is shown as a box
        made = _compiled(template, data, "pdf", **options)
    assert isinstance(made, bytes)
    return made


def pictures(template: str, data: Mapping[str, Any], sharpness: float = SHARPNESS) -> list[bytes]:
    """Its pages as PNG."""
    made = _compiled(template, data, "png", ppi=sharpness)
    return [made] if isinstance(made, bytes) else made


def _compiled(template: str, data: Mapping[str, Any], form: Literal["pdf", "png"], **options: Any) -> Any:  # noqa: ANN401
    with TemporaryDirectory(prefix="menshin-paper-") as empty:
        compiler = typst.Compiler(
            (PRELUDE + template).encode(),
            root=empty,
            font_paths=_fonts(),
            sys_inputs={
                "data": json.dumps(data, ensure_ascii=False),
                "language": spoken(),
                "texts": json.dumps({one: gettext(one) for one in marked(template)}, ensure_ascii=False),
            },
            package_path=empty,
            package_cache_path=empty,
        )
        return compiler.compile(format=form, **options)


@cache
def _fonts() -> typst.Fonts:
    """These fonts beside the compiler's own; none of the system's, so that all machines print alike."""
    return typst.Fonts(include_system_fonts=False, font_paths=font_folders())
