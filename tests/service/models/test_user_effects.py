"""Effects of the user's: an effect is one new file. Those that are added need a process of their own: effects are
compiled once."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from core.effects import EFFECTS
from service.cli import app

DOCUMENT = Path(__file__).resolve().parents[3] / "docs" / "models" / "effects-own.md"
EXAMPLE = re.search(r"```python\n(.*?)```", DOCUMENT.read_text(encoding="utf-8"), re.DOTALL)[1]  # type: ignore[index]

SUPPORT = str(Path(__file__).resolve().parents[2] / "support")

DRIVEN = """
import os
from pathlib import Path

import numpy as np

from core.model.force_response import force_response
from core.effects import EFFECTS
from core.model.isolator import Isolator
from few_effects import few_effects
from service.jobs.executors import local_processes
from service.user_effects import add_user_effects


def answer():
    u, v = np.zeros(20), np.linspace(-1.0, 2.0, 20)
    with few_effects(("drag",)):
        found = force_response(Isolator({"drag": {"drag": 3.0}}), u, v, 100.0, wanted=[("drag", "drag")])
    assert np.allclose(found.force, 3.0 * v * abs(v), rtol=1e-12)
    assert np.allclose(found.by_parameter[0], v * abs(v), rtol=1e-12)
    return float(found.force[-1])


if __name__ == "__main__":
    folder = Path(os.environ["MENSHIN_EFFECTS_FOLDER"])
    add_user_effects(folder)
    add_user_effects(folder)  # again does no harm
    print(EFFECTS["drag"].title, answer())
"""


def run(folder: Path, *command: str) -> "subprocess.CompletedProcess[str]":
    environment = {"MENSHIN_EFFECTS_FOLDER": str(folder), "PATH": "/usr/bin:/bin", "HOME": str(folder)}
    environment |= {"OMP_NUM_THREADS": "1", "PYTHONUTF8": "1", "COLUMNS": "200", "PYTHONPATH": SUPPORT}
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
    script = "".join(line for line in DRIVEN.splitlines(keepends=True) if "add_user_effects(folder)" not in line)
    script = script.replace('print(EFFECTS["drag"].title, answer())', WORKED)
    (folder.parent / "drive.py").write_text(script, encoding="utf-8")
    ended = run(folder, "drive.py")
    assert ended.stdout == "12.0\n", ended.stderr


WORKED = """assert "drag" not in EFFECTS
    executor = local_processes(1, folder)()
    print(executor.submit(answer).result())
    executor.shutdown()"""


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
def test_what_is_wrong_with_a_file_is_reported(
    folder: Path, monkeypatch: pytest.MonkeyPatch, name: str, text: str, message: str
) -> None:
    """In this process, which adds none of them and forgets the file's module afterwards."""
    (folder / "drag.py").unlink()
    (folder / f"{name}.py").write_text(text, encoding="utf-8")
    monkeypatch.setenv("MENSHIN_EFFECTS_FOLDER", str(folder))
    monkeypatch.chdir(folder.parent)
    before = dict(EFFECTS)
    try:
        ended = CliRunner(env={"COLUMNS": "200"}).invoke(app, ["effects"])
    finally:
        sys.modules.pop(f"menshin_own_effects.{name}", None)
    assert ended.exit_code == 2
    assert re.search(message, ended.stderr.replace("\n", " ")), ended.stderr
    assert before == EFFECTS


def test_a_folder_that_is_not_there_is_reported(tmp_path: Path) -> None:
    ended = menshin(tmp_path / "nowhere", "effects")
    assert ended.returncode == 2
    assert "nowhere is not a folder; create it, or remove the setting" in ended.stderr


NOTEBOOK = """
import linecache
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from core.effects import EFFECTS, add_effect
from core.fitting.fit import fitted
from core.fitting.data import FitData
from core.model.isolator import Isolator
from few_effects import few_effects
from synthetic_observations import observations
from service.user_effects import add_user_effects


def cell(number, text):
    \"\"\"Run as a notebook runs a cell: its source is kept under a name that is no file.\"\"\"
    name = f"<cell {number}>"
    linecache.cache[name] = (len(text), None, text.splitlines(keepends=True), name)
    exec(compile(text, name, "exec"), globals())


linear = Isolator({"elastic": {"k_b": 4e8}, "viscous": {"c_b": 6e6}})
wet = 5e7


def seen():
    one, = observations(linear, 0.01, 1, peaks=(0.05,), seconds=20.0)
    more = wet * one.layer.velocity * np.abs(one.layer.velocity)
    return [replace(one, layer=replace(one.layer, force=one.layer.force + more))]


def left(effects):
    found = fitted(FitData.by_noise(seen()), Isolator({**linear.effects, **effects}))
    return float(np.linalg.norm(found.residual)), found.model.effects


with few_effects():
    without, _ = left({})
    add_user_effects(Path(sys.argv[1]))
    cell(1, sys.argv[2].replace("Water drag", "Drag again"))
    add_effect("drag_of_a_cell", EFFECT)
    with_file, values = left({"drag": {"drag": 1e6}})
    with_cell, again = left({"drag_of_a_cell": {"drag": 1e6}})
    assert with_file < 0.6 * without, (with_file, without)
    assert abs(values["drag"]["drag"] / wet - 1) < 0.05, values
    assert abs(with_cell / with_file - 1) < 1e-6
    assert abs(left({})[0] / without - 1) < 1e-9
    print(EFFECTS["drag"].title, EFFECTS["drag_of_a_cell"].title)
"""


def test_an_effect_that_is_added_to_a_running_process_works_at_once(folder: Path) -> None:
    """From the own folder and from a notebook's cell, after a fit without either."""
    (folder.parent / "notebook.py").write_text(NOTEBOOK, encoding="utf-8")
    ended = run(folder, "notebook.py", str(folder), EXAMPLE)
    assert ended.stdout == "Water drag Drag again\n", ended.stderr


RUNAWAY = '''
"""A force with a limit, whose derivative is lost where the exponential is infinite."""

import math

from core.effect import Effect, LogNormal, Parameter


def law(u, size, steep):
    return size * math.copysign(min(math.exp(steep * abs(u)), 2.0), u)


EFFECT = Effect(
    title="Runaway",
    law=law,
    parameters=(
        Parameter("size", "N", (0.0, 1e9), LogNormal(1e6, 2.0), "half of the limit"),
        Parameter("steep", "1/m", (1e3, 1e7), LogNormal(1e5, 0.5), "how soon it is reached"),
    ),
    absent={"size": 0.0},
    linear=("size",),
    family="runaway",
    explanation="It runs away within 1 / {steep:.3g} m.",
    suspect_when="Never.",
    source="A test",
)
'''
DIAGNOSED = """
import sys
import warnings
from pathlib import Path

from core.model.isolator import Isolator
from few_effects import LINEAR_WITH_YIELDING, few_effects
from records_from_observations import records_from_observations
from synthetic_observations import BOUC_WEN, observations
from service.user_effects import add_user_effects
from service.jobs.stages import silent
from service.models.model_file import ModelFile
from service.models import documents
from service.models.operations import diagnose
from service.models.results import as_json

warnings.simplefilter("error")
with few_effects((*LINEAR_WITH_YIELDING, "friction")):
    add_user_effects(Path(sys.argv[1]))
    slides = {"sliding": 3e6, "share": 0.3, "a": 30.0, "slip": 1e-3}
    seen = observations(Isolator({**BOUC_WEN.effects, "friction": slides}), 0.02, 3, peaks=(0.02, 0.06))
    model = ModelFile("PAPER", "x", BOUC_WEN)
    found = diagnose(model, "given.toml", records_from_observations(seen), silent, ("runaway", "friction"))
    document = as_json(documents.diagnosis(found))
    print([one["effect"] for one in document["candidates"]], [one["effect"] for one in document["steps"]])
    print([one["effect"] for one in document["dropped"]], found.result.text[-1])
"""


def test_an_effect_whose_derivatives_diverge_is_dropped_and_named_and_the_diagnosis_goes_on(folder: Path) -> None:
    (folder / "drag.py").rename(folder / "_drag.py")
    (folder / "runaway.py").write_text(RUNAWAY, encoding="utf-8")
    (folder.parent / "diagnosed.py").write_text(DIAGNOSED, encoding="utf-8")
    ended = run(folder, "diagnosed.py", str(folder))
    assert ended.stdout.splitlines() == [
        "['friction'] ['friction']",
        "['runaway'] Runaway (runaway) could not be checked: the model's force, or its derivatives, grew beyond all "
        "bounds.",
    ], ended.stderr
