"""Charts in the language of their readers: a specification of Vega-Lite with its texts translated.

Whoever makes a chart writes it in English, and stored charts are English. What is translated here are the texts that a
chart shows: titles, of axes, legends and tooltips too, its description, texts in the plot, and the names of classes.
Data and names of fields stay as they are.
"""

import json
from collections.abc import Iterator, Mapping
from typing import Any

from service.language.choice import ENGLISH, Language, spoken
from service.language.translation import LETTERS, said

Spec = dict[str, Any]
UNREAD = frozenset(
    {"config", "data", "datasets", "params", "resolve", "scale", "sort", "transform", "usermeta", "values"}
)
"""Parts of a specification without a text for readers."""
TEXTS = frozenset({"title", "subtitle", "text", "description"})
CLASSES = frozenset({"nominal", "ordinal"})
GUIDES: Mapping[str, str] = {
    "x": "axis",
    "y": "axis",
    "row": "header",
    "column": "header",
    "facet": "header",
} | dict.fromkeys(("color", "fill", "stroke", "shape", "size", "opacity", "strokeDash", "strokeWidth"), "legend")
"""Words that name the classes of a channel."""
TIMES: Mapping[Language, dict[str, Any]] = {
    "ja": {
        "dateTime": "%Y年%-m月%-d日 %X",
        "date": "%Y/%m/%d",
        "time": "%H:%M:%S",
        "periods": ["午前", "午後"],
        "days": ["日曜日", "月曜日", "火曜日", "水曜日", "木曜日", "金曜日", "土曜日"],
        "shortDays": ["日", "月", "火", "水", "木", "金", "土"],
        "months": (months := [f"{month}月" for month in range(1, 13)]),
        "shortMonths": months,
    }
}
"""Names of months and days as the library d3-time-format has them, by language."""
WRITTEN = ("text", "tooltip")
"""Channels that show the value of a field."""


def translated(spec: Spec) -> Spec:
    """The specification in the language of what is being shown; itself in English.

    Args:
        spec: a picture's, as Altair's `to_dict` returns it, or a live chart's.
    """
    if spoken() == ENGLISH:
        return spec
    made: Spec = _Translation(spec).of(spec)
    made["usermeta"] = made.get("usermeta", {}) | {"embedOptions": {"timeFormatLocale": TIMES[spoken()]}}
    return made


class _Translation:
    """The translation of one specification."""

    def __init__(self, spec: Spec) -> None:
        self._rows = list(_rows(spec))
        self._names: dict[str, dict[str, str]] = {}

    def of(self, part: Any) -> Any:  # noqa: ANN401  any part of a specification
        if isinstance(part, list):
            return [self.of(one) for one in part]
        if not isinstance(part, dict):
            return part
        made = {name: one if name in UNREAD else self._part(name, one) for name, one in part.items()}
        if "encoding" in made:
            self._name_classes(made)
        return made

    def _part(self, name: str, part: Any) -> Any:  # noqa: ANN401
        if name in TEXTS and isinstance(part, str):
            return said(part)
        if name in TEXTS and isinstance(part, list) and all(isinstance(one, str) for one in part):
            return [said(one) for one in part]
        return self.of(part)

    def _name_classes(self, unit: Spec) -> None:
        """Name the classes of a unit's channels."""
        encoding = unit["encoding"] = dict(unit["encoding"])
        calculated: dict[str, Spec] = {}
        for channel, guide in GUIDES.items():
            if isinstance(encoding.get(channel), dict):
                encoding[channel] = self._with_labels(encoding[channel], guide)
        for channel in WRITTEN:
            given = encoding.get(channel)
            if given is not None:
                many = [
                    self._written(channel, one, calculated) for one in (given if isinstance(given, list) else [given])
                ]
                encoding[channel] = many if isinstance(given, list) else many[0]
        if calculated:
            unit["transform"] = [*unit.get("transform", ()), *calculated.values()]

    def _with_labels(self, definition: Spec, guide: str) -> Spec:
        """A channel whose axis, legend or header names the classes in the language."""
        field, own = definition.get("field"), definition.get(guide, {})
        if field is None or own is None:
            return definition
        has_own_name = "title" not in definition and "title" not in own
        if has_own_name and (guide == "legend" or " " in field):  # other fields are named for programs
            definition = definition | {"title": said(field)}
        if definition.get("type") not in CLASSES:
            return definition
        names = self._classes(field, definition)
        if not names or "labelExpr" in own:
            return definition
        return definition | {guide: own | {"labelExpr": _choice("datum.value", names, "datum.label")}}

    def _written(self, channel: str, definition: Any, calculated: dict[str, Spec]) -> Any:  # noqa: ANN401
        """A text or a line of a tooltip: a constant, or a field whose classes have names."""
        if not isinstance(definition, dict):
            return definition
        if isinstance(definition.get("value"), str):
            return definition | {"value": said(definition["value"])}
        field = definition.get("field")
        if field is None:
            return definition
        titled = {"title": said(field)} | definition if channel == "tooltip" else definition
        names = self._classes(field, definition) if definition.get("type") in CLASSES else {}
        if not names:
            return titled
        value = f"datum[{json.dumps(field)}]"
        calculated[field] = {"calculate": _choice(value, names, value), "as": f"{field}_said"}
        return titled | {"field": f"{field}_said"}

    def _classes(self, field: str, definition: Spec) -> dict[str, str]:
        """Names in the language, of the classes that have one."""
        if field not in self._names:
            self._names[field] = _named({row[field] for row in self._rows if isinstance(row.get(field), str)})
        domain = (definition.get("scale") or {}).get("domain")
        return self._names[field] | _named({one for one in domain or () if isinstance(one, str)})


def _named(classes: set[str]) -> dict[str, str]:
    return {one: name for one in sorted(classes) if LETTERS.search(one) and (name := said(one)) != one}


def _choice(value: str, names: Mapping[str, str], otherwise: str) -> str:
    """Expression of Vega: the name of a class."""
    chosen = (f"{value} === {_quoted(one)} ? {_quoted(name)} : " for one, name in names.items())
    return "".join(chosen) + otherwise


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _rows(part: Any) -> Iterator[Mapping[str, Any]]:  # noqa: ANN401
    """All rows of data in a specification."""
    if isinstance(part, list):
        for one in part:
            yield from _rows(one)
        return
    if not isinstance(part, dict):
        return
    for name, one in part.items():
        sets = one.values() if name == "datasets" else [one["values"]] if name == "data" and "values" in one else None
        if sets is None:
            yield from _rows(one)
        else:
            yield from (row for rows in sets for row in rows if isinstance(row, dict))
