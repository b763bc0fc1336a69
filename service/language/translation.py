"""Translation of texts and of composed sentences.

A sentence such as `Change of stiffness, direction x: 12 %` was composed from messages with places: `{title}: {value}`,
`{name}, direction {subject}`. It is translated by recognising the message whose fixed parts it contains, the most
specific one first, and by translating the values in the places in turn. A text that no message fits is split into
sentences and parts of sentences; what is left stays as it is: names, numbers, and words that people wrote.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from heapq import merge
from importlib import resources
from itertools import chain, pairwise
from operator import itemgetter
from string import Formatter

from service.language.choice import ENGLISH, Language, spoken

LONGEST = 4000
"""Letters of a text that is recognised; longer ones are people's."""
MOST_COMPARED = 200_000
"""Comparisons of a text, and of those within it, with messages; the longest of a diagnosis takes 15,000."""
DEEPEST = 8
"""Texts within texts."""
KEPT = 8192
"""Translations that a process keeps."""
SENTENCES = re.compile(r"(?<=[.!?]) (?=[A-Z0-9])")
"""Between two sentences."""
SENTENCE = ". "
STRONG = re.compile(rf"{SENTENCES.pattern}|; |: ")
"""Between the parts of a text that are translated apart, unless one message has them."""
KEY = 3
"""Letters at the beginning or end of a message by which it is found."""
MOST = 8
"""Parts of a message in the midst of a text."""
TELLING = 8
"""Letters of a fixed part that no value has in itself: it belongs to another message of that kind."""
WEAK = (", and ", " – ", ", ", " and ", " or ")
"""Separators of smaller parts, in the order of splitting."""
PARTS: Mapping[Language, Mapping[str, str]] = {
    "ja": {" ": "", "; ": "；", ": ": "：", ", and ": "、", " – ": " – ", ", ": "、", " and ": "と", " or ": "または"},
}
"""Replacements of the separators, by language."""
ENDS: Mapping[Language, str] = {"ja": "。"}
"""In place of a full stop."""
MONTHS = (
    "January", "February", "March", "April", "May", "June",
    "July", "August", "September", "October", "November", "December",
)  # fmt: skip
DATE = re.compile(rf"(\d{{1,2}}) ({'|'.join(MONTHS)}) (\d{{4}})(?:, (\d\d:\d\d))?")
PARENTHESIS = re.compile(r"(.+?) \(([^()]*)\)(.*)", re.DOTALL)
LAST = re.compile(r"(.+) \(([^()]*)\)", re.DOTALL)
QUANTITY = r"[−-]?\d[\d.,]*(?: ± \d[\d.,]*)?(?: (?:%|[a-zA-Z/²³]{1,5}))?"
ENDING = re.compile(rf"(?P<words>.+?) {QUANTITY}", re.DOTALL)
BEGINNING = re.compile(rf"{QUANTITY} (?P<words>.+)", re.DOTALL)
ENGLISH_WORD = re.compile(r"(?<![\w/.-])(?!gal\b)[a-z]{3,}(?![\w/.-])")
CODE = re.compile(r"`[^`]*`|(?<!\w)'[^']*'(?!\w)")
"""A command or a quoted value."""
FEWEST, PROVING = 5, 15
"""Letters of a message in whose places a word may stay English, and any number of them: `{0} of {1}` proves little."""
LETTERS = re.compile(r"[A-Za-z]{2}")


@dataclass(frozen=True, slots=True)
class Message:
    """A message with places, and its translation."""

    literals: tuple[str, ...]
    """Texts before, between and after the places."""
    names: tuple[str, ...]
    """The places', one fewer."""
    translation: str

    @property
    def weight(self) -> int:
        """Letters that a text must have: the more, the more specific."""
        return sum(map(len, self.literals))

    @property
    def letters(self) -> int:
        """Number of letters of what stands beside the places."""
        return sum(letter.isalpha() for literal in self.literals for letter in literal)

    def is_told_by(self, values: Iterable[str]) -> bool:
        """True if the text was composed from it, by its letters and by what is left in English of its values."""
        left = (
            [word for word in ENGLISH_WORD.findall(CODE.sub("", value)) if word not in _codes()] for value in values
        )
        words = max(map(len, left), default=0)
        return self.letters >= PROVING or words == 0 or (words == 1 and self.letters >= FEWEST)

    def values(self, text: str) -> dict[str, str] | None:
        """Contents of the places in a text; None if the message does not fit."""
        first, last = self.literals[0], self.literals[-1]
        at, end = len(first), len(text) - len(last)
        if at > end or not (text.startswith(first) and text.endswith(last)):
            return None
        found = []
        for literal in self.literals[1:-1]:
            following = text.find(literal, at, end)
            if following < 0:
                return None
            found.append(text[at:following])
            at = following + len(literal)
        found.append(text[at:end])
        least = TELLING if self.letters >= PROVING else 1
        telling = [literal for literal in self.literals if len(literal) >= least and LETTERS.search(literal)]
        if any(SENTENCES.search(value) or any(one in value for one in telling) for value in found):
            return None
        if any(value.count("(") != value.count(")") for value in found):
            return None
        return dict(zip(self.names, found, strict=True))

    def is_torn(self, values: Mapping[str, str]) -> bool:
        """True if a value holds an end or several parts of a sentence that no fixed part of the message separates."""
        fixed = "".join(self.literals)
        after = dict(zip(self.names, self.literals, strict=False))
        return any(
            (value.endswith(".") and not after[name].endswith(SENTENCE))
            or (len(outside(value, ": ")) > 1 and ":" not in fixed)
            or (len(outside(value, "; ")) > 1 and ":" not in fixed and ";" not in fixed)
            for name, value in values.items()
            if not after[name].endswith("(")
        )


def is_outside(text: str, at: int) -> bool:
    """True if that place of a text stands in no parentheses."""
    return text.count("(", 0, at) <= text.count(")", 0, at)


def outside(text: str, separator: str) -> list[str]:
    """The parts of a text between separators that stand in no parentheses."""
    parts: list[str] = []
    opened = 0
    for part in text.split(separator):
        if opened > 0:
            parts[-1] += separator + part
        else:
            parts.append(part)
        opened = max(0, opened + part.count("(") - part.count(")"))
    return parts


def _codes() -> frozenset[str]:
    """Names of effects and of their parameters, which are the same in every language.

    Those of the process too: a computation that has few effects may be the first to ask.
    """
    from core.effects import EFFECTS, process_effects

    return _codes_of(frozenset({*process_effects(), *EFFECTS}))


@cache
def _codes_of(names: frozenset[str]) -> frozenset[str]:
    from core.effects import EFFECTS, process_effects

    known = {**process_effects(), **EFFECTS}
    return names.union(one.name for name in names for one in known[name].parameters)


def parsed(message: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Literals and names of places of a message for `str.format`."""
    literals, names = [""], []
    for literal, name, _, _ in Formatter().parse(message):
        literals[-1] += literal
        if name is not None:
            names.append(name)
            literals.append("")
    return tuple(literals), tuple(names)


class _Messages:
    """Messages, the most specific first, found by their beginning or end."""

    def __init__(self, messages: Sequence[Message]) -> None:
        self._ranked: dict[tuple[str, str], list[tuple[int, Message]]] = {}
        for ranked in enumerate(messages):
            first, last = ranked[1].literals[0], ranked[1].literals[-1]
            key = (first[:KEY], "") if len(first) >= KEY else ("", last[-KEY:]) if len(last) >= KEY else ("", "")
            self._ranked.setdefault(key, []).append(ranked)

    def like(self, text: str) -> Iterator[Message]:
        """Messages that may fit a text."""
        keys = {(text[:KEY], ""), ("", text[-KEY:]), ("", "")}
        found = merge(*(self._ranked.get(key, ()) for key in keys), key=itemgetter(0))
        return (message for _, message in found)


class Catalogue:
    """The messages of a language.

    Args:
        translations: by the message in English; a plural's by its singular.
        language: their language.
    """

    def __init__(self, translations: Mapping[str, str], language: Language) -> None:
        self.exact = dict(translations)
        self._language = language
        made = [
            Message(*parsed(message), translation)
            for message, translation in translations.items()
            if "{" in message and "%(" not in message
        ]
        worded = (one for one in made if one.names and any(map(LETTERS.search, one.literals)))
        self._messages = _Messages(sorted(worded, key=lambda one: (-one.weight, len(one.names))))

    def said(self, text: str) -> str | None:
        """A text in the language; None if no message fits it, or if finding out would take too long."""
        try:
            return _Reading(self.exact, self._messages, self._language).said(text)
        except _TooLongError:
            return None


class _TooLongError(Exception):
    """A text was compared with too many messages."""


class _Reading:
    """The translation of one text, with everything within it.

    Args:
        exact: translations of whole messages.
        messages: with places.
        language: theirs.
    """

    def __init__(self, exact: Mapping[str, str], messages: _Messages, language: Language) -> None:
        self.exact, self._messages, self._language = exact, messages, language
        self._known: dict[tuple[str, int], str | None] = {}
        self._compared = 0

    def said(self, text: str, depth: int = 0) -> str | None:
        """A text in the language; None if no message fits it.

        Raises:
            _TooLongError: it takes too many comparisons, as a text may that was written to that end.
        """
        if text in self.exact:
            return self.exact[text]
        if depth > DEEPEST or len(text) > LONGEST or not LETTERS.search(text):
            return None
        if (text, depth) not in self._known:
            self._known[text, depth] = (
                self._varied(text, depth, is_whole=True)
                or self._parts(text, depth)
                or self._varied(text, depth, is_whole=False)
                or self._split(text, depth)
                or self._parenthesis(text, depth)
                or self._beside_quantity(text, depth)
            )
        return self._known[text, depth]

    def _like(self, text: str) -> Iterator[Message]:
        """Messages that may fit a text, each of which is counted."""
        for message in self._messages.like(text):
            self._compared += 1
            if self._compared > MOST_COMPARED:
                raise _TooLongError
            yield message

    def _recognised(self, text: str, depth: int, *, is_whole: bool) -> str | None:
        """A text by the most specific message that fits it.

        Args:
            text: in English.
            depth: of the text within others.
            is_whole: whether no value may hold the parts of a sentence that the message itself does not separate.
        """
        for message in self._like(text):
            values = message.values(text)
            if values is not None and not (is_whole and message.is_torn(values)):
                said = {name: self._value(value, depth) for name, value in values.items()}
                if message.is_told_by(said.values()):
                    return filled(message.translation, said)
        return None

    def _value(self, value: str, depth: int) -> str:
        core = value.strip()
        said = self.said(core, depth + 1) if core else None
        return value if said is None else value.replace(core, said)

    def _varied(self, text: str, depth: int, *, is_whole: bool) -> str | None:
        """The same of a text whose first letter or full stop differs from the message's."""
        other = text if text in _codes() else text[:1].swapcase() + text[1:]
        variants = [(one.removesuffix(end), end) for end in ("", ".") if text.endswith(end) for one in (text, other)]
        looked_up = ((self.exact.get(bare), end) for bare, end in variants)
        recognised = ((self._recognised(bare, depth, is_whole=is_whole), end) for bare, end in variants)
        for found, end in chain(looked_up, recognised):
            if found is not None:
                return found + (ENDS[self._language] if end else "")
        return None

    def _parts(self, text: str, depth: int) -> str | None:
        """A text of several sentences, or of parts of one, of which those of one message stay together."""
        between = [one for one in STRONG.finditer(text) if is_outside(text, one.start())]
        if not between:
            return None
        edges = [(0, 0), *((one.start(), one.end()) for one in between), (len(text), len(text))]
        places = self._together(text, edges)
        parts = [text[edges[first][1] : edges[end][0]] for first, end in pairwise(places)]
        said = [self._part(part, depth) for part in parts]
        if not any(one is not None for one in said):
            return None
        joined = ""
        for at, (part, one) in enumerate(zip(parts, said, strict=True)):
            separator = text[slice(*edges[places[at]])]
            of_language = PARTS[self._language].get(separator, separator)
            is_known = one is not None and (not at or said[at - 1] is not None)
            joined += (of_language if of_language or is_known else separator) + (part if one is None else one)
        return joined

    def _together(self, text: str, edges: Sequence[tuple[int, int]]) -> list[int]:
        """The edges at which a text is split so that most of its letters are those of messages."""
        count = len(edges) - 1
        best, following = [0] * (count + 1), list(range(1, count + 2))
        for first in range(count - 1, -1, -1):
            best[first] = best[first + 1] + self._weight(text[edges[first][1] : edges[first + 1][0]])
            for end in range(first + 2, min(first + MOST, count) + 1):
                if (first, end) == (0, count):
                    continue
                weight = self._weight(text[edges[first][1] : edges[end][0]])
                if weight and weight + best[end] > best[first]:
                    best[first], following[first] = weight + best[end], end
        places = [0]
        while places[-1] < count:
            places.append(following[places[-1]])
        return places

    def _weight(self, text: str) -> int:
        """Letters of the most specific message that fits a text; 0 without one."""
        bare = text.removesuffix(".")
        for one in (text, bare, bare[:1].swapcase() + bare[1:]):
            if one in self.exact:
                return len(one)
            for message in self._like(one):
                values = message.values(one)
                if values is not None and not message.is_torn(values):
                    return message.weight
        return 0

    def _split(self, text: str, depth: int) -> str | None:
        for separator in WEAK:
            parts = outside(text, separator)
            if len(parts) > 1 and (said := self._joined(parts, PARTS[self._language][separator], depth)):
                return said
        return None

    def _parenthesis(self, text: str, depth: int) -> str | None:
        last = LAST.fullmatch(text)
        head = None if last is None else self._part(last[1], depth)
        if last is not None and head is not None:
            return f"{head}（{self._part(last[2], depth) or last[2]}）"
        inside = PARENTHESIS.fullmatch(text)
        if inside is None:
            return None
        said = [self._part(part, depth) for part in inside.groups()]
        if all(part is None for part in said):
            return None
        before, within, after = (part or given for part, given in zip(said, inside.groups(), strict=True))
        return f"{before}（{within}）{after}"

    def _beside_quantity(self, text: str, depth: int) -> str | None:
        """The same of a text that begins or ends with a value and its unit."""
        for pattern in (ENDING, BEGINNING):
            if found := pattern.fullmatch(text):
                said = self.said(found["words"], depth + 1)
                if said is not None:
                    return text[: found.start("words")] + said + text[found.end("words") :]
        return None

    def _part(self, part: str, depth: int) -> str | None:
        return self.said(part, depth + 1) if part else None

    def _joined(self, parts: Sequence[str], separator: str, depth: int) -> str | None:
        """Parts in the language; None if none of them is known."""
        said = [self._part(part, depth) for part in parts]
        if not any(one is not None for one in said):
            return None
        shown = [part if one is None else one for part, one in zip(parts, said, strict=True)]
        return separator.join(shown)


def filled(translation: str, values: Mapping[str, str]) -> str:
    """A translation with its places filled; values are not formatted again."""
    literals, names = parsed(translation)
    return literals[0] + "".join(values[name] + literal for name, literal in zip(names, literals[1:], strict=True))


def singular(text: str | Sequence[str] | None) -> str:
    """A message, or the first form of a plural's; empty for None."""
    return text if isinstance(text, str) else (text or ("",))[0]


@cache
def catalogue(language: Language) -> Catalogue:
    """The catalogue of all rooms in a language."""
    from babel.messages.pofile import read_po  # English needs no catalogue

    translations: dict[str, str] = {}
    for file in sorted(resources.files("service.language").joinpath(language).iterdir(), key=lambda one: one.name):
        if not file.name.endswith(".po"):
            continue
        with file.open("rb") as opened:
            for entry in read_po(opened, locale=language):
                english, translation = singular(entry.id), singular(entry.string)
                if english and translation:
                    translations[english] = translation
    return Catalogue(translations, language)


@lru_cache(maxsize=KEPT)
def _kept(text: str, language: Language) -> str:
    return DATE.sub(_date, catalogue(language).said(text) or text)


def _date(found: re.Match[str]) -> str:
    day, month, year, at = found.groups()
    return f"{year}年{MONTHS.index(month) + 1}月{day}日" + (f" {at}" if at else "")


def said(text: str, language: Language | None = None) -> str:
    """A text that the program composed, in a language; as it is where no message fits it.

    Args:
        text: in English.
        language: that of what is being shown if none is given.
    """
    language = language or spoken()
    return text if language == ENGLISH or not text else _kept(text, language)


def gettext(message: str) -> str:
    """A message of a template in the language of what is being shown."""
    language = spoken()
    return message if language == ENGLISH else catalogue(language).exact.get(message, message)


def ngettext(singular: str, plural: str, number: int) -> str:
    """The same of a message with a number."""
    language = spoken()
    if language == ENGLISH:
        return singular if number == 1 else plural
    return catalogue(language).exact.get(singular, plural)
