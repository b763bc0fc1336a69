"""Effects of the user's: an effect is one new file, in processes of their own since effects are compiled once."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

DOCUMENT = Path(__file__).resolve().parents[2] / "docs" / "effects-own.md"
EXAMPLE = re.search(r"```python\n(.*?)```", DOCUMENT.read_text(encoding="utf-8"), re.DOTALL)[1]  # type: ignore[index]

DRIVEN = """
import os
from pathlib import Path

import numpy as np

from core.model.driven import driven
from core.effects import EFFECTS
from core.model.isolator import Isolator
from service.computing.executors import local_processes
from service.own_effects import add_own_effects


def answer():
    u, v = np.zeros(20), np.linspace(-1.0, 2.0, 20)
    found = driven(Isolator({"drag": {"drag": 3.0}}), u, v, 100.0, wanted=[("drag", "drag")])
    assert np.allclose(found.force, 3.0 * v * abs(v), rtol=1e-12)
    assert np.allclose(found.by_parameter[0], v * abs(v), rtol=1e-12)
    return float(found.force[-1])


if __name__ == "__main__":
    folder = Path(os.environ["MENSHIN_EFFECTS_FOLDER"])
    add_own_effects(folder)
    add_own_effects(folder)  # again does no harm
    print(EFFECTS["drag"].title, answer())
"""


def run(folder: Path, *command: str) -> "subprocess.CompletedProcess[str]":
    environment = {"MENSHIN_EFFECTS_FOLDER": str(folder), "PATH": "/usr/bin:/bin", "HOME": str(folder)}
    environment |= {"OMP_NUM_THREADS": "1", "PYTHONUTF8": "1", "COLUMNS": "200"}
    return subprocess.run(
        [sys.executable, *command], env=environment, cwd=folder.parent, capture_output=True, text=True, check=False
    )


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    made = tmp_path / "effects"
    made.mkdir()
    (made / "drag.py").write_text(EXAMPLE, encoding="utf-8")
    return made


def menshin(folder: Path, *words: str) -> "subprocess.CompletedProcess[str]":
    return run(folder, "-c", "from service.cli import app; app()", *words)


def test_the_documented_effect_is_driven_and_differentiated(folder: Path) -> None:
    (folder.parent / "drive.py").write_text(DRIVEN, encoding="utf-8")
    ended = run(folder, "drive.py")
    assert ended.stdout == "Water drag 12.0\n", ended.stderr


def test_the_command_line_knows_it(folder: Path) -> None:
    ended = menshin(folder, "effects", "drag")
    assert "Water drag" in ended.stdout, ended.stderr
    assert "Morison" in ended.stdout


@pytest.mark.slow
def test_processes_that_compute_know_it_too(folder: Path) -> None:
    """A worker process begins without it, and learns it before its first task."""
    script = "".join(line for line in DRIVEN.splitlines(keepends=True) if "add_own_effects(folder)" not in line)
    script = script.replace('print(EFFECTS["drag"].title, answer())', WORKED)
    (folder.parent / "drive.py").write_text(script, encoding="utf-8")
    ended = run(folder, "drive.py")
    assert ended.stdout == "12.0\n", ended.stderr


WORKED = """assert "drag" not in EFFECTS
    executor = local_processes(1, folder)()
    print(executor.submit(answer).result())
    executor.shutdown(wait=True, kill_workers=True)"""


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("drag", EXAMPLE.replace("drag * v * abs(v)", "round(drag) * v"), r"drag.py, line \d+: `round`: cannot be"),
        ("drag", EXAMPLE.replace("EFFECT =", "EFFEKT ="), "has no EFFECT; each file of effects_folder defines one"),
        ("drag", "EFFECT = 3", "the effect drag must be a core.effect.Effect, got 3"),
        ("drag", "EFFECT = 1 / 0", "cannot be run: ZeroDivisionError: division by zero"),
        ("elastic", EXAMPLE, "an effect cannot be called 'elastic'"),
    ],
)
def test_what_is_wrong_with_a_file_is_told(folder: Path, name: str, text: str, message: str) -> None:
    (folder / "drag.py").unlink()
    (folder / f"{name}.py").write_text(text, encoding="utf-8")
    ended = menshin(folder, "effects")
    assert ended.returncode == 2
    assert re.search(message, ended.stderr.replace("\n", " ")), ended.stderr


def test_a_folder_that_is_not_there_is_told(tmp_path: Path) -> None:
    ended = menshin(tmp_path / "nowhere", "effects")
    assert ended.returncode == 2
    assert "nowhere is no folder; make it, or leave the setting out" in ended.stderr


def test_an_effect_that_comes_after_the_first_model_ran_is_refused(folder: Path) -> None:
    (folder.parent / "late.py").write_text(
        "import sys\nfrom pathlib import Path\nfrom core.effects import settled\n"
        "from service.own_effects import add_own_effects\nsettled()\nadd_own_effects(Path(sys.argv[1]))\n",
        encoding="utf-8",
    )
    ended = run(folder, "late.py", str(folder))
    assert "drag comes too late: the effects are compiled; add it before the first model is run" in ended.stderr
