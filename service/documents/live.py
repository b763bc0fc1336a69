"""Charts for a browser: the specification behind a still picture with hover and zoom, and its numbers as tables.

A chart's tooltips name its fields with their units; hover and tables show these.
"""

import csv
import io
from collections.abc import Container, Iterator, Mapping, Sequence
from copy import deepcopy
from datetime import UTC, datetime
from typing import Any

from service.documents.charts import DARK_COLOURS, DARK_CONFIG, INK, brief
from service.documents.document import Numbers, numbers
from service.language.translation import said

Spec = dict[str, Any]
ROWS = ("hconcat", "vconcat", "concat")
CONTINUOUS = frozenset({"quantitative", "temporal"})
POINTED = frozenset({"line", "point", "circle"})
"""Marks of which the nearest is shown."""
TIME = "time"
"""Field of a point's time, s."""
ZOOM = "wheel![event.ctrlKey]"
"""Without the key a wheel scrolls the page; a pinch on a touch pad counts as a wheel with it."""


def live(spec: Spec) -> Spec:
    """The specification with nearest points under the pointer, zoom and pan, and the colours of the dark theme.

    Its numbers are rounded to six digits; those of `tables` and `as_csv` are not.

    Args:
        spec: a picture's, as Altair's `to_dict` returns it.
    """
    made = deepcopy({name: part for name, part in spec.items() if name != "datasets"})
    made["datasets"] = {name: [_rounded(row) for row in rows] for name, rows in spec.get("datasets", {}).items()}
    brushes = {view: one["name"] for one in made.get("params", ()) for view in one.get("views", ())}
    panels = []
    for number, panel in enumerate(_panels(made)):
        curves = list(_curves(panel, made))
        brush = next((brushes[view] for one in _leaves(panel) if (view := one.get("name")) in brushes), None)
        axes = _add_zoom(panel, f"zoom_{number}", brushes)
        _add_nearest(panel, f"nearest_{number}")
        panels += [{"zoom": f"zoom_{number}", "axes": axes, "brush": brush, "curves": curves}] if axes else []
    dark = {"colours": DARK_COLOURS, "config": DARK_CONFIG}
    made["usermeta"] = made.get("usermeta", {}) | {"dark": dark, "panels": panels}
    return made


def _curves(panel: Spec, spec: Spec) -> Iterator[dict[str, Any]]:
    """The lines of a panel whose points have times: rows, fields and names, for a cursor."""
    seen = set()
    for unit in _inherited(panel, spec.get("data")):
        encoding, data = unit["encoding"], unit["data"] or {}
        titles = {one["field"]: one.get("title", one["field"]) for one in encoding.get("tooltip", ())}
        rows = spec["datasets"].get(data.get("name"))
        if _mark(unit) != "line" or TIME not in titles or not rows or data["name"] in seen:
            continue
        seen.add(data["name"])
        x, y, of = (encoding.get(channel, {}).get("field") for channel in ("x", "y", "color"))
        of = of if of in rows[0] else None
        names = {axis: said(titles.get(field, field)) for axis, field in {"time": TIME, "x": x, "y": y}.items()}
        labels = {label: said(label) for label in dict.fromkeys(row[of] for row in rows)} if of else {}
        yield {"data": data["name"], "x": x, "y": y, "of": of, "names": names, "labels": labels}


def _rounded(row: Mapping[str, Any]) -> dict[str, Any]:
    """A row with its numbers to six digits; whole ones stay, such as times in milliseconds."""
    return {
        name: brief(value) if isinstance(value, float) and not value.is_integer() else value
        for name, value in row.items()
    }


def tables(spec: Spec) -> list[tuple[str, Numbers]]:
    """The numbers of a picture: a table for each set of rows, with its panel's title; columns as in the tooltips.

    In the language of what is being shown; `as_csv` is in English always.
    """
    found = []
    for title, columns, rows in _sets(spec):
        shown = [{said(name): _read(row.get(field), kind) for field, name, kind in columns} for row in rows]
        found.append((said(title), numbers(shown)))
    return found


def as_csv(spec: Spec) -> bytes:
    """The same numbers in full, tables one below the other with an empty line between two."""
    out = io.StringIO()
    writer = csv.writer(out)
    for number, (title, columns, rows) in enumerate(_sets(spec)):
        if number:
            writer.writerow([])
        writer.writerow([f"{name}, {title}" if title else name for _, name, _ in columns])
        writer.writerows([_cell(row.get(field), kind) for field, _, kind in columns] for row in rows)
    return out.getvalue().encode()


def title(spec: Spec) -> str:
    """A picture's title in one line."""
    found = spec.get("title", "")
    text = found.get("text", "") if isinstance(found, dict) else found
    return " ".join(text) if isinstance(text, list) else text


def _sets(spec: Spec) -> Iterator[tuple[str, Sequence[tuple[str, str, str]], Sequence[Mapping[str, Any]]]]:
    """Title, columns (field, name, type) and rows, of every set of rows with tooltips."""
    seen = set()
    for panel in _panels(spec):
        for unit in _inherited(panel, spec.get("data")):
            tooltips = unit["encoding"].get("tooltip")
            rows = _rows(unit["data"], spec)
            if not tooltips or not rows:
                continue
            columns = [(one["field"], one.get("title", one["field"]), one["type"]) for one in tooltips]
            key = repr((title(panel), columns, unit["data"]))
            if key not in seen:
                seen.add(key)
                yield title(panel) if panel is not spec else "", columns, rows


def _rows(data: Mapping[str, Any] | None, spec: Spec) -> Sequence[Mapping[str, Any]]:
    if not data:
        return []
    found: Sequence[Mapping[str, Any]] = data["values"] if "values" in data else spec["datasets"][data["name"]]
    return found


def _read(value: object, kind: str) -> object:
    """A cell for readers: the names of classes in their language."""
    shown = _cell(value, kind)
    return said(shown) if kind == "nominal" and isinstance(shown, str) else shown


def _cell(value: object, kind: str) -> object:
    if kind == "temporal" and isinstance(value, int | float):
        return f"{datetime.fromtimestamp(value / 1e3, UTC):%Y-%m-%d %H:%M:%S}"
    return "" if value is None else value


def _panels(spec: Spec) -> Iterator[Spec]:
    parts = [part for name in ROWS for part in spec.get(name, ())]
    if not parts:
        yield spec
    for part in parts:
        yield from _panels(part)


def _leaves(panel: Spec) -> Iterator[Spec]:
    if "layer" not in panel:
        yield panel
    for part in panel.get("layer", ()):
        yield from _leaves(part)


def _inherited(panel: Spec, data: object, encoding: Mapping[str, Any] | None = None) -> Iterator[Spec]:
    """Layers that are drawn, each with the data and encoding that it inherits."""
    own = dict(encoding or {}) | panel.get("encoding", {})
    data = panel.get("data", data)
    if "layer" not in panel:
        yield panel | {"encoding": own, "data": data}
    for part in panel.get("layer", ()):
        yield from _inherited(part, data, own)


def _name(unit: Spec) -> str | None:
    return unit.get("name")


def _add_zoom(panel: Spec, name: str, brushed: Container[str | None]) -> dict[str, str]:
    """Zoom and pan along the continuous axes, whose fields it returns; where a window is brushed, dragging brushes."""
    has_brush = any(_name(one) in brushed for one in _leaves(panel))
    for leaf, unit in zip(_leaves(panel), _inherited(panel, None), strict=True):
        encoding = unit["encoding"]
        fields = {one: encoding[one]["field"] for one in ("x", "y") if encoding.get(one, {}).get("type") in CONTINUOUS}
        if len(fields) < len(("x", "y")) or _name(leaf) in brushed:  # Vega-Lite drops all but the brush of that layer
            continue
        axes = ["x"] if has_brush else list(fields)
        select = {"type": "interval", "encodings": axes, "zoom": ZOOM} | ({"translate": False} if has_brush else {})
        leaf.setdefault("params", []).append({"name": name, "select": select, "bind": "scales"})
        return {axis: fields[axis] for axis in axes}
    return {}


def _add_nearest(panel: Spec, name: str) -> None:
    """The point of the uppermost curve or cloud that is nearest to the pointer, with its tooltip."""
    marked = [one for one in _inherited(panel, None) if _mark(one) in POINTED and "tooltip" in one["encoding"]]
    if not marked:
        return
    shown = marked[-1]
    encoding = {channel: shown["encoding"][channel] for channel in ("x", "y", "tooltip")}
    if panel.get("resolve", {}).get("axis", {}).get("x") == "independent":
        encoding["x"] = encoding["x"] | {"axis": None}
    encoding["opacity"] = {"condition": {"param": name, "empty": False, "value": 1}, "value": 0}
    select = {"type": "point", "nearest": True, "on": "pointermove", "clear": "pointerout"}
    layer: Spec = {
        "mark": {"type": "point", "filled": True, "size": 70, "color": INK, "tooltip": True},
        "encoding": encoding,
    }
    layer["params"] = [{"name": name, "select": select}]
    if shown["data"]:
        layer["data"] = shown["data"]
    if "layer" not in panel:
        inner = {key: panel.pop(key) for key in ("mark", "encoding", "params", "name") if key in panel}
        panel["layer"] = [inner]
    panel["layer"].append(layer)


def _mark(unit: Spec) -> str:
    mark = unit.get("mark", "")
    return str(mark["type"] if isinstance(mark, dict) else mark)
