"""Records of a building whose layer runs against a moat wall, as files, and the model that its design would be."""

from pathlib import Path

import pytest
from click.testing import Result
from hidden import files
from hidden.trial import Trial, trial
from typer.testing import CliRunner

from core.model.isolator import Isolator
from service.cli import app
from service.models.model_file import ModelFile, written


@pytest.fixture(autouse=True)
def _own_settings(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """No settings of the one who runs the tests."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MENSHIN_SETTINGS", raising=False)


def menshin(*arguments: object) -> Result:
    return CliRunner().invoke(app, [*map(str, arguments)])


def without_the_hidden(of: Trial) -> Isolator:
    """The true layer but for what is hidden."""
    layer = of.building.layer
    bouc_wen = {"F_y": layer.F_y, "D_y": layer.D_y, "beta": layer.beta, "gamma": 1 - layer.beta, "A": 1.0, "n": 1.0}
    return Isolator({"elastic": {"k_b": layer.k}, "viscous": {"c_b": layer.c}, "bouc_wen": bouc_wen})


@pytest.fixture(scope="session")
def moat() -> Trial:
    """The gap is 48 mm wide; the second earthquake goes to 19 mm, the third to 74."""
    return trial("moat", 1)


@pytest.fixture(scope="session")
def folder(moat: Trial, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Building, records and model."""
    made = tmp_path_factory.mktemp("moat")
    files.write(moat, made)
    (made / "model.toml").write_text(written(ModelFile("TRIAL", "x", without_the_hidden(moat))), "utf-8")
    return made
