"""Records of a building whose layer meets a moat wall, as files, and the model of its design."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from cached_executor import CachedExecutor
from hidden import files
from hidden.trial import Trial, trial

from core.model.isolator import Isolator
from service.models.model_file import ModelFile, written


@pytest.fixture(scope="session", autouse=True)
def _analysed_once() -> Iterator[None]:
    """Commands keep their analyses for other tests of this run: those of `folder` are of the same earthquakes."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(CachedExecutor.folder))
        patch.setenv("MENSHIN_JOBS__KEPT_ROOM", "1")
        yield


def without_the_hidden(of: Trial) -> Isolator:
    """The true layer without the hidden effect."""
    layer = of.building.layer
    bouc_wen = {"F_y": layer.F_y, "D_y": layer.D_y, "beta": layer.beta, "gamma": 1 - layer.beta, "A": 1.0, "n": 1.0}
    return Isolator({"elastic": {"k_b": layer.k}, "viscous": {"c_b": layer.c}, "bouc_wen": bouc_wen})


@pytest.fixture(scope="session")
def moat() -> Trial:
    """The gap is 48 mm wide; the second earthquake reaches 19 mm, the third 74 mm."""
    return trial("moat", 1)


@pytest.fixture(scope="session")
def folder(moat: Trial, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Building, records and model."""
    made = tmp_path_factory.mktemp("moat")
    files.write(moat, made)
    (made / "model.toml").write_text(written(ModelFile("TRIAL", "x", without_the_hidden(moat))), "utf-8")
    return made
