"""The documentation site: `sphinx-build --fail-on-warning --keep-going -c docs . build/site`.

Its pages are the README, the other Markdown files of the project, and a Python reference that every build writes from
the docstrings of `core`. The site loads nothing from other hosts: formulas are MathML, fonts are the reader's own.
"""

import gc
import re
from collections.abc import Iterator
from importlib.metadata import version as installed_version
from inspect import getdoc
from pathlib import Path
from pkgutil import iter_modules, resolve_name, walk_packages
from types import FunctionType, GenericAlias

from docutils import nodes
from latex2mathml.converter import convert
from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx
from sphinx.ext.napoleon.docstring import GoogleDocstring
from sphinx.util import logging
from sphinx.util.typing import stringify_annotation
from sphinx.writers.html5 import HTML5Translator

import core
from core import arrays

gc.set_threshold(50_000, 20, 20)  # nodes live until the end: garbage collection took a sixth of the time

project = "Menshin"
author = "The Menshin authors"
copyright = "2026, The Menshin authors"
version = release = installed_version("menshin")

extensions = ["myst_parser", "sphinx.ext.autodoc"]
root_doc = "README"
include_patterns = ["*.md", "benchmarks/README.md", "docs/**.md"]
exclude_patterns = [".*", "build", "dist"]
myst_enable_extensions = ["dollarmath", "html_image"]
highlight_language = "none"
myst_heading_anchors = 4
nitpicky = False  # annotations name private helpers and compiled functions, which have no page
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "ignore-module-all": True}
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True
toc_object_entries = False
add_module_names = False

html_theme = "furo"
html_title = f"Menshin {release}"
html_math_renderer = "mathml"
html_copy_source = False
html_show_sphinx = False
html_theme_options = {"sidebar_hide_name": False}

CONTENTS = """
```{toctree}
:hidden:

docs/operate/index
docs/models/index
docs/reference/index
docs/development/index
CHANGELOG
```
"""
"""The site's menu, appended to the README."""
PYTHON = Path(__file__).parent / "reference" / "python"
"""Folder of the Python pages, one for each module or package directly below `core`; not in version control."""
PYTHON_INDEX = """\
# Python reference

`core` takes values and returns values: it opens no files, and all units are SI. `import core` offers these names; the
pages below describe every module, from its docstrings.

| name | |
|---|---|
{names}

```{{toctree}}
{pages}
```
"""
ARRAYS = {
    stringify_annotation(alias, "smart"): name
    for name, alias in vars(arrays).items()
    if isinstance(alias, GenericAlias)
}
"""Names of array types in `core.arrays` by what autodoc writes for them."""
CODE = re.compile(r"``(.+?)``|`([^`]+)`", re.DOTALL)
"""Code in a docstring."""


def write_python_pages(_: Sphinx) -> None:
    """Write a page for each room of `core`, with all of its modules."""
    PYTHON.mkdir(exist_ok=True)
    rooms = [found.name for found in iter_modules(core.__path__, "core.")]
    for room in rooms:
        package = Path(core.__path__[0]) / room.removeprefix("core.")
        inside = [found.name for found in walk_packages([str(package)], f"{room}.")] if package.is_dir() else []
        parts = [f"# `{room}`\n", _module(room), *(f"## `{name}`\n\n{_module(name)}" for name in inside)]
        _update(PYTHON / f"{room}.md", "\n".join(parts))
    _update(PYTHON / "index.md", PYTHON_INDEX.format(names="\n".join(_library()), pages="\n".join(rooms)))
    for page in set(PYTHON.glob("core.*.md")) - {PYTHON / f"{room}.md" for room in rooms}:
        page.unlink()


def _library() -> Iterator[str]:
    """Table rows of what `import core` offers, with links to the pages of its modules."""
    for name in core.__all__:
        offered = getattr(core, name)
        described = isinstance(offered, type | FunctionType)
        link = f"{{py:obj}}`{name} <{offered.__module__}.{name}>`" if described else f"`{name}`"
        summary = (getdoc(offered) or "").partition("\n\n")[0].replace("\n", " ") if described else ""
        yield f"| {link} | {summary} |"


def _module(name: str) -> str:
    bases = "   :show-inheritance:\n" if name == "core.errors" else ""
    return f"```{{eval-rst}}\n.. automodule:: {name}\n{bases}```\n"


def _update(page: Path, text: str) -> None:
    """Write a page if it differs, so that Sphinx reads only what changed."""
    if not page.exists() or page.read_text("utf-8") != text:
        page.write_text(text, "utf-8")


class Docstring(GoogleDocstring):
    """A docstring whose `Returns:` section is a description, without a type before a colon."""

    def _consume_returns_section(self, preprocess_types: bool = False) -> list[tuple[str, str, list[str]]]:
        lines = self._dedent(self._consume_to_next_section())
        return [("", "", lines)] if lines else []


def as_restructured_text(
    _app: Sphinx, what: str, name: str, _object: object, _options: object, lines: list[str]
) -> None:
    """Convert a docstring: plain text, code in backticks, sections such as `Raises:`. Names of `core` become links."""
    text, parts, end = "\n".join(lines), [], 0
    for found in CODE.finditer(text):
        code = (found[1] or found[2]).replace("\n", " ")
        is_ours = re.fullmatch(r"core(\.\w+)+", code) is not None
        if is_ours:
            _check_name(code, name)
        parts += [_escaped(text[end : found.start()]), f":py:obj:`{code}`" if is_ours else f"``{code}``"]
        end = found.end()
    text = "".join([*parts, _escaped(text[end:])])
    has_sections = what in ("function", "method", "class", "exception")
    lines[:] = Docstring(text, what=what).lines() if has_sections else text.split("\n")


def _check_name(code: str, place: str) -> None:
    """Warn if a name that a docstring mentions does not exist."""
    try:
        resolve_name(code)
    except (AttributeError, ImportError):
        logging.getLogger(__name__).warning("the docstring of %s names %s, which does not exist", place, code)


def _escaped(text: str) -> str:
    return re.sub(r"([*|]|_\b)", r"\\\1", text)


def name_arrays(_app: Sphinx, *signature: object) -> tuple[str | None, str | None]:
    """Write `Vector` in signatures, not the type that it abbreviates."""
    arguments, returned = (_with_aliases(str(part)) if part else None for part in signature[-2:])
    return arguments, returned


def _with_aliases(text: str) -> str:
    for long, short in ARRAYS.items():
        text = text.replace(long, short)
    return text


def with_contents(_: Sphinx, page: str, source: list[str]) -> None:
    """Append the menu to the README."""
    if page == root_doc:
        source[0] += CONTENTS


def write_front_page(app: Sphinx, failure: Exception | None) -> None:
    """Lead from the site's root to the README."""
    if failure is None:
        redirect = '<!doctype html><meta http-equiv="refresh" content="0; url=README.html"><title>Menshin</title>\n'
        (Path(app.outdir) / "index.html").write_text(redirect, "utf-8")


def _formula(self: HTML5Translator, node: nodes.math) -> None:
    self.body.append(convert(node.astext()))
    raise nodes.SkipNode


def _displayed_formula(self: HTML5Translator, node: nodes.math_block) -> None:
    self.body.append(f'<div class="math">{convert(node.astext(), display="block")}</div>')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Register what this file adds to Sphinx."""
    app.connect("builder-inited", write_python_pages)
    app.connect("autodoc-process-docstring", as_restructured_text)
    app.connect("autodoc-process-signature", name_arrays)
    app.connect("source-read", with_contents)
    app.connect("build-finished", write_front_page)
    app.add_lexer("csv", TextLexer)
    app.add_html_math_renderer("mathml", (_formula, None), (_displayed_formula, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
