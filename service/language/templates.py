"""Templates whose texts are shown in the language of the reader: those of Jinja, and those of Typst.

A template of Typst marks a text as `t("Checks")`, and one with places as `t("page {page} of {pages}", page: ..)`.
"""

import re
from collections.abc import Iterator

from jinja2 import Environment, pass_context
from jinja2.runtime import Context

from service.language.choice import LANGUAGES, spoken
from service.language.translation import gettext, ngettext, said

MARKED = re.compile(r"""(?<![\w-])t\("((?:[^"\\]|\\.)*)\"""")
"""A marked text of a template of Typst."""


def translate(environment: Environment) -> None:
    """Let the templates of Jinja mark texts for gettext, and show what the program says by `said`."""
    environment.add_extension("jinja2.ext.i18n")
    environment.policies["ext.i18n.trimmed"] = True
    environment.install_gettext_callables(gettext, ngettext, newstyle=True)  # type: ignore[attr-defined]  # of the extension
    environment.globals |= {"language": spoken, "languages": LANGUAGES}
    environment.filters["said"] = _said


@pass_context
def _said(context: Context, text: str) -> str:  # with the context, so that a constant is not translated once for all
    return said(text)


def marked(source: str) -> Iterator[str]:
    """The marked texts of a template of Typst."""
    for found in MARKED.finditer(source):
        yield found[1].replace('\\"', '"')
