"""Every kind of finding that core makes is explained in docs/operate/screening.md, and nothing else is."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MAKERS = {"Finding", "Fault"}


def kinds_in_code() -> Iterator[str]:
    for path in (ROOT / "core").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in MAKERS:
                kind = node.args[0]
                if isinstance(kind, ast.Constant) and isinstance(kind.value, str):
                    yield kind.value


def test_every_kind_of_finding_is_documented() -> None:
    text = (ROOT / "docs" / "operate" / "screening.md").read_text(encoding="utf-8")
    documented = re.findall(r"^\| `(\w+)` \|", text, flags=re.MULTILINE)
    result = set(kinds_in_code())
    assert len(result) > 10
    assert set(documented) == result
    assert documented == sorted(documented)
