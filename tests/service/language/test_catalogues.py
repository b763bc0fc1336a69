"""Every message that people read has a translation, with the same places, and is recognised when it is filled."""

import re
from collections.abc import Sequence
from itertools import count
from pathlib import Path

import pytest
from babel.messages.catalog import Catalog
from babel.messages.pofile import read_po

from service.language.choice import ENGLISH, LANGUAGES
from service.language.extraction import FOLDER, SOURCES, expected, messages
from service.language.translation import filled, parsed, said, singular

PLACE = re.compile(r"%\(\w+\)[sd]")
JAPANESE = re.compile(r"[\u3040-\u30ff\u4e00-\u9fff]")
WORD = re.compile(r"\b[a-z]{4,}\b")
CATALOGUES = [(language, name) for language in LANGUAGES if language != ENGLISH for name in SOURCES]


def read(language: str, name: str) -> Catalog:
    with (FOLDER / language / f"{name}.po").open("rb") as opened:
        return read_po(opened, locale=language)


def places(message: str) -> set[str]:
    found = set(PLACE.findall(message))
    if found:
        return found
    try:
        return set(parsed(message)[1])
    except ValueError:
        return set()


def allowed(message: str | Sequence[str]) -> set[str]:
    """Places that a translation may have; a plural's has the number always."""
    return places(message) if isinstance(message, str) else {"%(num)s"}.union(*map(places, message))


@pytest.mark.parametrize(("language", "name"), CATALOGUES)
def test_a_catalogue_has_exactly_the_messages_of_its_files(language: str, name: str) -> None:
    there = {singular(entry.id) for entry in read(language, name) if entry.id}
    wanted = set(expected(name))
    assert there == wanted, "python -m service.language.extraction updates the catalogues"


@pytest.mark.parametrize(("language", "name"), CATALOGUES)
def test_every_message_is_translated_with_its_places(language: str, name: str) -> None:
    entries = [entry for entry in read(language, name) if entry.id]
    assert [singular(one.id) for one in entries if not singular(one.string) or one.fuzzy] == []
    assert [singular(one.id) for one in entries if not places(singular(one.string)) <= allowed(one.id)] == []
    if language == "ja":
        in_words = [one for one in entries if WORD.search(PLACE.sub("", singular(one.id)))]
        assert [singular(one.id) for one in in_words if not JAPANESE.search(singular(one.string))] == []


@pytest.mark.parametrize(("language", "name"), CATALOGUES)
def test_a_filled_message_is_recognised_as_itself(language: str, name: str) -> None:
    wrong = []
    for entry in read(language, name):
        message = singular(entry.id)
        if not message or "{" not in message or "%(" in message:
            continue
        names = parsed(message)[1]
        values = dict(zip(dict.fromkeys(names), map(str, count(101)), strict=False))
        given = filled(message, values)
        if said(given, language) != filled(singular(entry.string), values):  # type: ignore[arg-type]  # of LANGUAGES
            wrong.append((given, said(given, language)))  # type: ignore[arg-type]
    assert wrong == []


@pytest.mark.parametrize(("language", "name"), CATALOGUES)
def test_a_translation_of_a_template_s_message_can_be_filled(language: str, name: str) -> None:
    values = dict.fromkeys((found[2:-2] for entry in read(language, name) for found in allowed(entry.id)), "1")
    for entry in read(language, name):
        if any(file.endswith(".html") for file, _ in entry.locations):
            assert singular(entry.string) % values  # a per cent sign is written twice


def test_a_message_of_several_catalogues_has_one_translation() -> None:
    for language in {language for language, _ in CATALOGUES}:
        said_as: dict[str, set[str]] = {}
        for name in SOURCES:
            for entry in read(language, name):
                if entry.id:
                    said_as.setdefault(singular(entry.id), set()).add(singular(entry.string))
        assert {message: found for message, found in said_as.items() if len(found) > 1} == {}


def test_a_message_of_a_template_is_extracted_as_the_page_asks_for_it(tmp_path: Path) -> None:
    path = tmp_path / "spectrum.html"
    path.write_text("{% trans %}Damped by 5 %{% endtrans %}{% trans n=9 %}{{ n }} %{% endtrans %}")
    assert list(messages(path)) == ["Damped by 5 %%", "%(n)s %%"]


def test_a_title_is_a_message_even_if_it_is_one_word(tmp_path: Path) -> None:
    path = tmp_path / "effect.py"
    path.write_text('EFFECT = Effect(title="Friction", family="hysteresis", shape="point", description="Of steel.")')
    assert list(messages(path)) == ["Friction", "hysteresis"]


@pytest.mark.parametrize(("language", "name"), CATALOGUES)
def test_texts_of_templates_can_be_filled(language: str, name: str) -> None:
    of_templates = {message for message, files in expected(name).items() if any(one.endswith(".html") for one in files)}
    for entry in read(language, name):
        if entry.id and singular(entry.id) in of_templates:
            for text in (singular(entry.id), singular(entry.string)):
                given = {place[2:-2]: "1" for place in PLACE.findall(text)}
                assert text % given, text  # as the pages fill every text, without places too
