"""Extraction of the messages that the catalogues must contain: `python -m service.language.extraction` updates them.

Templates mark their messages for gettext. Of the Python modules that `SOURCES` names, every text with two words or more
is a message, and every word that is a constant, a value of a constant mapping, or a title; an f-string is a message
with numbered places. Documentation strings, descriptions for the API and lines of the log are not.
"""

import ast
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from babel.messages.catalog import Catalog
from babel.messages.extract import extract
from babel.messages.pofile import read_po, write_po

from service.language.choice import ENGLISH, LANGUAGES
from service.language.templates import marked
from service.language.translation import parsed

ROOT = Path(__file__).parents[2]
FOLDER = Path(__file__).parent
SOURCES: Mapping[str, tuple[str, ...]] = {
    "access": (
        "service/access/auth.py",
        "service/access/keys.py",
        "service/access/pages/*.py",
        "service/access/provider.py",
        "service/access/roles.py",
        "service/http/templates/key*.html",
        "service/http/templates/link*.html",
        "service/http/templates/login.html",
        "service/http/templates/signed_in.html",
    ),
    "analyses": (
        "core/analysis.py",
        "core/estimators/*.py",
        "core/estimators/frame/*.py",
        "core/isolation_layer/*.py",
        "service/analyses/added_sensors.py",
        "service/analyses/api/events.py",
        "service/analyses/pages.py",
        "service/analyses/schema.py",
        "service/analyses/store.py",
        "service/http/templates/chart*.html",
        "service/http/templates/event*.html",
        "service/http/templates/modes.html",
    ),
    "buildings": (
        "service/buildings/pages/*.py",
        "service/buildings/recipient_rules.py",
        "service/buildings/recipients.py",
        "service/buildings/reference_periods.py",
        "service/http/templates/building*.html",
        "service/http/templates/sensors.html",
        "service/http/templates/home.html",
    ),
    "http": (
        "service/http/error_pages.py",
        "service/http/forms.py",
        "service/http/problems.py",
        "service/http/templates/error.html",
        "service/http/templates/form_parts.html",
        "service/http/templates/layout.html",
    ),
    "models": (
        "core/comparison/compared.py",
        "core/comparison/covariates.py",
        "core/comparison/failure.py",
        "core/diagnosis/*.py",
        "core/effects/*.py",
        "core/fitting/fit.py",
        "core/fitting/search.py",
        "core/forecasting/*.py",
        "core/model/isolator.py",
        "core/model/simulation.py",
        "core/sketching/terms.py",
        "core/sketching/texts.py",
        "core/workbench/*.py",
        "service/http/templates/diagnosis.html",
        "service/http/templates/effect*.html",
        "service/http/templates/forecast.html",
        "service/http/templates/sketch.html",
        "service/http/templates/model*.html",
        "service/models/forecasting.py",
        "service/models/motions.py",
        "service/models/pages/[!p]*.py",
        "service/models/schema.py",
        "service/models/texts.py",
    ),
    "messages": (
        "service/notify/texts.py",
        "service/notify/claims.py",
        "service/notify/channels/chat*.py",
        "service/notify/channels/mail.py",
        "service/notify/channels/outbound_http.py",
        "service/notify/channels/templates/mail.html",
        "service/alerts/recipients.py",
        "service/http/templates/message*.html",
        "service/http/templates/receiver_secret.html",
    ),
    "alerts": ("service/alerts/texts.py", "service/http/templates/alert*.html"),
    "drift": (
        "core/drift/alarms.py",
        "core/drift/causes.py",
        "core/drift/explanations.py",
        "core/drift/quantities.py",
        "core/drift/rules.py",
        "core/drift/within_event.py",
        "core/rounding.py",
        "service/drift/pages.py",
        "service/drift/texts.py",
        "service/http/templates/drift.html",
    ),
    "jobs": (
        "service/http/templates/job*.html",
        "service/jobs/queue.py",
        "service/jobs/requests.py",
        "service/jobs/schema.py",
        "service/jobs/worker.py",
        "service/kinds.py",
    ),
    "records": (
        "service/records/file_store.py",
        "service/records/originals.py",
        "service/formats/[!_]*.py",
        "service/http/templates/recordings.html",
        "service/parsing/process.py",
        "service/records/ingest.py",
        "service/records/queries.py",
        "service/records/source_poller.py",
        "service/records/sources/*.py",
        "service/records/streams/follower.py",
        "service/records/streams/packets.py",
        "service/records/streams/seedlink.py",
        "service/records/trigger.py",
    ),
    "sensors": ("core/sensors/*.py",),
    "reports": (
        "service/reports/building_year.py",
        "service/reports/check_lines.py",
        "service/reports/earthquake.py",
        "service/reports/pictures.py",
        "service/reports/texts.py",
        "service/reports/year.py",
        "service/reports/templates/*",
        "service/documents/templates/document.html",
    ),
    "charts": (
        "service/documents/charts.py",
        "service/analyses/event_charts.py",
        "service/analyses/api/pictures.py",
        "service/analyses/api/event_pictures.py",
        "service/drift/charts.py",
        "service/models/pages/pictures.py",
        "service/models/effect_loops.py",
        "service/models/figures/*.py",
        "service/reports/charts.py",
    ),
    "verdict": (
        "service/http/templates/verdict_parts.html",
        "service/verdict/accumulated.py",
        "service/verdict/assessment.py",
        "service/verdict/earthquakes.py",
        "service/verdict/checks.py",
        "service/verdict/limits.py",
        "service/verdict/measured.py",
        "service/verdict/reading.py",
        "service/verdict/shaking.py",
        "service/verdict/texts.py",
    ),
}
"""Files of each catalogue: patterns relative to the project's folder."""
NOT_SHOWN = frozenset(
    {
        "description",
        "summary",
        "help",
        "example",
        "examples",
        "pattern",
        "alias",
        "operation_id",
        "labelExpr",
        "expression",
    }
)
"""Arguments whose texts programs or developers read."""
LOGGED = frozenset({"debug", "info", "warning", "error", "exception", "compile", "getLogger", "TypeVar", "getattr"}) | {
    "Memory",
    "condition",
    "transform_filter",
    "transform_calculate",
}
"""Functions whose texts nobody reads on a page: names, lines of the log, expressions of charts."""
TITLED = frozenset({"title", "subtitle", "family"})
"""Arguments whose texts people read, however short."""
DRAWN = re.compile(r"(.*_)?(CONFIG|SHAPES)")
"""Constants that say how a chart is drawn."""
FIELD = re.compile(r".*:[QNOT]|.*=\".*|<.*", re.DOTALL)
"""A field of a chart with its type, or markup."""
PLACE = re.compile(r"\{\d+\}")
NAMED = re.compile(r"\{[^{}]*\}")
"""A place of a text for `str.format`."""
LETTERS = re.compile(r"[A-Za-z]{2}")
EDGES = " ,;:\n"
"""Joints between parts of a sentence, which are no part of the message."""
NAMES = re.compile(r"api|file|lax|strict|menshin(-[a-z]+)*")
"""Words that programs read."""
WORDS = re.compile(r"[A-Za-z]{2,}[^A-Za-z]* [^A-Za-z]*[A-Za-z]|[A-Za-z]{2,}.* .*[A-Za-z]|\ba [a-z]{2,}", re.DOTALL)
LABEL = re.compile(r"[A-Za-z][a-z]{2,} \([^()]+\)")
"""A quantity with its unit."""
TYPE = re.compile(r"\w+( \| \w+)+|.*\(\?.*", re.DOTALL)
"""An annotation as a text, or a regular expression with a named group."""
WORD = re.compile(r"[A-Za-z][a-z]{2,}(-[a-z]+)*|[A-Z]{4,}")


def messages(path: Path) -> Iterator[str]:
    """The messages of a template or a module; a plural's by its singular."""
    if path.suffix == ".py":
        yield from _of_module(ast.parse(path.read_text("utf-8")))
        return
    if path.suffix == ".typ":
        yield from marked(path.read_text("utf-8"))
        return
    with path.open("rb") as opened:
        options = dict.fromkeys(("trimmed", "newstyle_gettext", "trim_blocks", "lstrip_blocks"), "true")
        for _, found, _, _ in extract("jinja2", opened, options=options | {"silent": "false"}):
            yield found[0] if isinstance(found, tuple | list) else found


def _of_module(module: ast.Module) -> Iterator[str]:
    hidden = {id(node) for one in ast.walk(module) for node in _unread(one)}
    yield from _texts(module, hidden)


def _texts(node: ast.AST, hidden: set[int]) -> Iterator[str]:
    if id(node) in hidden:
        return
    if isinstance(node, ast.JoinedStr):
        message = _with_places(node)
        if LETTERS.search(PLACE.sub("", message)) and " " in message and not FIELD.fullmatch(message):
            yield message.strip(EDGES)
        for part in node.values:
            if isinstance(part, ast.FormattedValue):
                yield from _texts(part.value, hidden)
        return
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        is_text = WORDS.search(node.value) or LABEL.fullmatch(node.value)
        is_text = is_text and LETTERS.search(NAMED.sub("", node.value))
        if is_text and not FIELD.fullmatch(node.value) and not TYPE.fullmatch(node.value):
            yield _without_formats(node.value).strip(EDGES)
        return
    if isinstance(node, ast.Dict):
        for value in node.values:
            yield from _words(value)
    if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        if any(isinstance(name, ast.Name) and name.id.isupper() for one in targets for name in ast.walk(one)):
            for value in _constants(node.value, is_named=any(isinstance(one, ast.Tuple) for one in targets)):
                yield from _words(value)
    if isinstance(node, ast.keyword) and node.arg in TITLED:
        one = node.value.value if isinstance(node.value, ast.Constant) else ""
        if isinstance(one, str) and LETTERS.search(one) and not (WORDS.search(one) or LABEL.fullmatch(one)):
            yield one
    for child in ast.iter_child_nodes(node):
        yield from _texts(child, hidden)


def _constants(value: ast.expr, *, is_named: bool) -> Sequence[ast.expr]:
    """The values of a constant that may be words: of a mapping, a single text, or several that each have a name."""
    if isinstance(value, ast.Dict):
        return ()  # those of every mapping are
    if isinstance(value, ast.Tuple):
        return value.elts if is_named else ()
    return [value]


def _words(node: ast.AST) -> Iterator[str]:
    """A single word that is a value; those of a tuple likewise."""
    for one in node.elts if isinstance(node, ast.Tuple | ast.List) else [node]:
        if (
            isinstance(one, ast.Constant)
            and isinstance(one.value, str)
            and WORD.fullmatch(one.value)
            and not NAMES.fullmatch(one.value)
        ):
            yield one.value


def _unread(node: ast.AST) -> Iterator[ast.AST]:
    """Parts of a node that are documentation, descriptions for programs, or lines of the log."""
    body = getattr(node, "body", None)
    if isinstance(body, list):
        yield from (one for one in body if isinstance(one, ast.Expr) and isinstance(one.value, ast.Constant))
    if isinstance(node, ast.Call):
        name = getattr(node.func, "attr", getattr(node.func, "id", ""))
        if name in LOGGED:
            yield from (*node.args, *node.keywords)
        yield from (one for one in node.keywords if one.arg in NOT_SHOWN)
    if isinstance(node, ast.AnnAssign | ast.arg) and node.annotation is not None:
        yield node.annotation
    if isinstance(node, ast.Assign | ast.AnnAssign):
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        if node.value is not None and any(isinstance(one, ast.Name) and DRAWN.fullmatch(one.id) for one in targets):
            yield node.value
    if isinstance(node, ast.FunctionDef):
        yield from node.decorator_list
    if isinstance(node, ast.Dict):
        yield from (one for one in node.keys if one is not None)
        named = zip(node.keys, node.values, strict=True)
        yield from (value for key, value in named if isinstance(key, ast.Constant) and key.value in NOT_SHOWN)
    if isinstance(node, ast.Subscript):
        yield node.slice


def _with_places(node: ast.JoinedStr) -> str:
    """`{0} of {1} shown`."""
    parts, count = [], 0
    for part in node.values:
        if isinstance(part, ast.Constant):
            parts.append(str(part.value).replace("{", "{{").replace("}", "}}"))
        else:
            parts.append(f"{{{count}}}")
            count += 1
    return "".join(parts)


def _without_formats(text: str) -> str:
    """`{share} %` of `{share:.0f} %`; a text that is not for `str.format` as it is."""
    try:
        literals, names = parsed(text)
    except ValueError:
        return text
    if not names:
        return text
    named = [name or str(number) for number, name in enumerate(names)]
    rest = "".join(f"{{{name}}}{literal}" for name, literal in zip(named, literals[1:], strict=True))
    return literals[0] + rest


def expected(name: str) -> dict[str, list[str]]:
    """Files by message, of one catalogue."""
    found: dict[str, list[str]] = {}
    for pattern in SOURCES[name]:
        paths = sorted(ROOT.glob(pattern))
        if not paths:
            raise FileNotFoundError(f"no file is like {pattern}, of the catalogue {name}")
        for path in paths:
            for message in messages(path):
                files = found.setdefault(message, [])
                if (file := path.relative_to(ROOT).as_posix()) not in files:
                    files.append(file)
    return found


def main() -> int:
    """Update every catalogue: new messages without a translation, none that is gone; 1 if translations are missing."""
    missing = 0
    for language in LANGUAGES:
        if language == ENGLISH:
            continue
        for name in SOURCES:
            path = FOLDER / language / f"{name}.po"
            before = Catalog(locale=language)
            if path.exists():
                with path.open("rb") as opened:
                    before = read_po(opened, locale=language)
            made = Catalog(locale=language, project="Menshin", fuzzy=False)
            for message, files in expected(name).items():
                known = before.get(message)
                translation = known.string if known is not None else ""
                made.add(message, translation, locations=[(file, 0) for file in files])
                missing += not translation
            with path.open("wb") as opened:
                write_po(opened, made, width=120, omit_header=True, include_lineno=False)
    sys.stdout.write(f"{missing} messages have no translation\n")
    return 1 if missing else 0


if __name__ == "__main__":
    sys.exit(main())
