"""English text in a page in Japanese."""

import re
from collections.abc import Iterable
from html.parser import HTMLParser

EMPTY = frozenset({"br", "img", "input", "meta", "link", "hr", "wbr", "path", "circle", "line", "rect", "use"})
"""Elements without an end."""
SILENT = frozenset({"script", "style", "code", "pre"})
"""Elements whose text is for programs."""
READ = ("title", "aria-label", "alt", "placeholder")
"""Attributes that people read or hear."""
WORDS = re.compile(r"(?<![\w/.:-])[A-Za-z][a-z]{2,} [a-z]{2,}(?![\w/.-])")
"""Two words in a row: single ones may be names."""


class _Texts(HTMLParser):
    """Texts and attributes of a page that are in its language."""

    def __init__(self) -> None:
        super().__init__()
        self.texts: list[str] = []
        self._within: list[tuple[str, bool]] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        hidden = tag in SILENT or given.get("lang") == "en" or any(is_hidden for _, is_hidden in self._within)
        if not hidden:
            self.texts += [value for name in READ if (value := given.get(name))]
        if tag not in EMPTY:
            self._within.append((tag, hidden))

    def handle_endtag(self, tag: str) -> None:
        while any(name == tag for name, _ in self._within):
            if self._within.pop()[0] == tag:
                break

    def handle_data(self, data: str) -> None:
        if not any(hidden for _, hidden in self._within):
            self.texts.append(data)


def english_left(page: str, names: Iterable[str]) -> list[str]:
    """Texts of a page that hold two English words in a row.

    Args:
        page: HTML.
        names: what people wrote, which is not translated.
    """
    parser = _Texts()
    parser.feed(page)
    written = re.compile("|".join(map(re.escape, sorted(names, key=len, reverse=True))) or "$^")
    return [text.strip() for text in parser.texts if WORDS.search(written.sub("", text))]
