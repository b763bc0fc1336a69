"""Compiled functions are cached, and never used once their sources have changed."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np

from core.code_generation.compilation import bound, cached, digest
from core.effects import EFFECTS

MODULE = """
factor = None


def scaled(x):
    return FACTOR * factor() * x


FACTOR = 2.0
"""
SCRIPT = """
from core.code_generation.compilation import bound, jitted, cached
import kernels

@jitted
def factor():
    return {factor}

compiled = cached(bound(kernels.scaled, factor=factor), "{digest}")
print(compiled(1.0), sum(compiled.stats.cache_hits.values()))
"""


def run(folder: Path, factor: float, reported: str) -> tuple[float, int]:
    if not (folder / "kernels.py").exists():
        (folder / "kernels.py").write_text(MODULE, encoding="utf-8")
    ended = subprocess.run(
        [sys.executable, "-c", SCRIPT.format(factor=factor, digest=reported)],
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
    )
    value, hits = ended.stdout.split()
    return float(value), int(hits)


def test_a_later_process_finds_it_unless_what_it_is_made_of_changed(tmp_path: Path) -> None:
    assert run(tmp_path, 3.0, "first") == (6.0, 0)
    assert run(tmp_path, 3.0, "first") == (6.0, 1)
    assert run(tmp_path, 5.0, "second") == (10.0, 0)


def test_where_no_folder_can_be_written_it_is_compiled_all_the_same() -> None:
    """As of a function whose file is not there: numba then finds no place."""
    namespace: dict[str, object] = {}
    exec(compile("def doubled(x):\n    return 2 * x", "nowhere.py", "exec"), namespace)
    assert cached(bound(namespace["doubled"]), "any")(np.float64(4.0)) == 8.0  # type: ignore[arg-type]


def test_the_digest_knows_laws_and_the_numbers_that_they_read() -> None:
    """Friction reads a number of its own file: another number is another digest, though the law's text is the same."""
    only = {"friction": EFFECTS["friction"]}
    before = digest(only)
    assert digest({"friction": EFFECTS["elastic"]}) != before
    assert digest(only, "more") != before
    law: Any = EFFECTS["friction"].law
    slower = FunctionType(law.__code__, {**law.__globals__, "SHORTEST": 0.1})
    assert digest({"friction": replace(EFFECTS["friction"], law=slower)}) != before
    assert digest(only) == before
