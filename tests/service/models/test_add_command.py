"""`menshin model add` by the front door: the wall that the records meet, and what is refused."""

import json
from pathlib import Path

import pytest
from command import menshin
from hidden.trial import Trial

from service.models.model_file import read

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("own_settings")]


def test_the_wall_is_added_at_its_true_distance(folder: Path, moat: Trial) -> None:
    """2 mm: the contact of the truth is another law's within its first millimetres; 4 standard deviations are less."""
    files = (folder / "event2.mseed", folder / "event3.mseed", "--hold-out", folder / "event1.mseed")
    out = ("--building", folder / "building.toml", "-o", "walled.toml", "--json", "added.json")
    done = menshin("model", "add", "moat", folder / "model.toml", *files, *out)
    assert done.exit_code == 0, done.output
    ((_, true),) = moat.hidden
    model = read(Path("walled.toml").read_text("utf-8"))
    assert model.isolator.effects["moat"]["gap"] == pytest.approx(true["gap"], abs=2e-3)
    document = json.loads(Path("added.json").read_text("utf-8"))
    assert document["added"]["delta_bic"] < -10
    assert document["added"]["error_after"] < 0.6 * document["added"]["error_before"]
    assert "The records support it" in " ".join(done.output.split())


@pytest.mark.parametrize(("effect", "reason"), [("magic", "there is no effect 'magic'"), ("elastic", "already")])
def test_what_cannot_be_added_ends_with_two(effect: str, reason: str, folder: Path) -> None:
    arguments = (folder / "model.toml", folder / "event1.mseed", "--building", folder / "building.toml", "-o", "x.toml")
    done = menshin("model", "add", effect, *arguments)
    assert done.exit_code == 2
    assert reason in " ".join(done.output.replace("│", " ").split())
    assert not Path("x.toml").exists()
