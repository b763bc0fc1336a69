"""What all tests of a run share."""

import os

import pytest
from computed import Computed


@pytest.fixture(scope="session", autouse=True)
def _computed_once(tmp_path_factory: pytest.TempPathFactory) -> None:
    """A folder for results, the same for all processes of the run."""
    own = tmp_path_factory.getbasetemp()
    Computed.folder = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "computed"
    Computed.folder.mkdir(exist_ok=True)
