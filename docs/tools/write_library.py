"""Run the examples of the library's documents and write their output: `python docs/tools/write_library.py`.

The documents are their own sources: docs/models/library.md, whose `python` blocks are run one after the other and whose
`text` blocks get what each prints, and docs/models/library.ipynb, whose cells are run. library.md reads the real
building's records in ../shared/data, from the top of the checkout.
"""

import json
import re
import sys
from collections.abc import Iterator
from contextlib import chdir, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "models" / "library.md"
NOTEBOOK = PAGE.with_suffix(".ipynb")
BLOCK = re.compile(r"```python\n(?P<code>.*?)```\n(?:\n```text\n(?P<output>.*?)```\n)?", re.DOTALL)
"""An example, and the output that follows it if it prints anything."""


def page(text: str) -> str:
    """The page with the output of its examples."""
    names: dict[str, Any] = {}

    def with_output(found: re.Match[str]) -> str:
        output = printed(found["code"], names)
        return f"```python\n{found['code']}```\n" + (f"\n```text\n{output}```\n" if output else "")

    return BLOCK.sub(with_output, text)


def notebook(document: dict[str, Any]) -> dict[str, Any]:
    """The notebook with the output of its cells."""
    names: dict[str, Any] = {}
    cells = list(_cells(document["cells"], names))
    return {**document, "cells": cells}


def _cells(cells: list[dict[str, Any]], names: dict[str, Any]) -> Iterator[dict[str, Any]]:
    count = 0
    for cell in cells:
        if cell["cell_type"] != "code":
            yield cell
            continue
        count += 1
        output = printed("".join(cell["source"]), names).splitlines(keepends=True)
        stream = [{"name": "stdout", "output_type": "stream", "text": output}] if output else []
        yield {**cell, "execution_count": count, "outputs": stream}


def printed(code: str, names: dict[str, Any]) -> str:
    """Standard output of some code, which is run at the top of the checkout and may use and set names."""
    output = StringIO()
    with chdir(ROOT), redirect_stdout(output):
        exec(compile(code, "example", "exec"), names)
    return output.getvalue()


def write() -> None:
    """Both documents, or those that are named on the command line."""
    for path in map(Path, sys.argv[1:] or [PAGE, NOTEBOOK]):
        if path.suffix == ".md":
            path.write_text(page(path.read_text("utf-8")), "utf-8")
        else:
            made = notebook(json.loads(path.read_text("utf-8")))
            path.write_text(json.dumps(made, indent=1, ensure_ascii=False) + "\n", "utf-8")


if __name__ == "__main__":
    write()
