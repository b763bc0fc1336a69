"""`menshin model` and `menshin effects`, by the front door."""

from pathlib import Path

import pytest
from building_files import SMALL
from command import menshin

from core.effects import EFFECTS
from core.paper import ISOLATOR
from service.models.model_file import read

pytestmark = pytest.mark.usefixtures("own_settings")

BOTH = f"""{SMALL}
[[channel]]
id = "XX.TOWER.01.HNY"
level = "slab"
direction = "y"
quantity = "acceleration"
"""
"""With a sensor along y too."""


def test_the_first_model_has_the_design_values(tmp_path: Path) -> None:
    (tmp_path / "building.toml").write_text(BOTH, "utf-8")
    done = menshin("model", "new", "--building", "building.toml", "--direction", "y", "-o", "made/first.toml")
    assert done.exit_code == 0, done.output
    model = read(Path("made/first.toml").read_text("utf-8"))
    assert (model.building, model.direction, model.assumed) == ("TOWER", "y", ())
    assert set(model.isolator.effects) == set(ISOLATOR.effects)
    assert model.isolator.effects["bouc_wen"]["F_y"] == 655.4e3


def test_values_that_the_design_does_not_give_are_named(tmp_path: Path) -> None:
    (tmp_path / "building.toml").write_text(BOTH.replace("c_b = 6.0e6\n", ""), "utf-8")
    done = menshin("model", "new", "--building", "building.toml", "--direction", "xy", "-o", "first.toml")
    assert "c_b: not given in [isolation.design], only a start" in done.output
    assert read(Path("first.toml").read_text("utf-8")).assumed == ("c_b",)


@pytest.mark.parametrize("direction", ["y", "xy"])
def test_a_direction_that_the_building_does_not_measure_is_refused(tmp_path: Path, direction: str) -> None:
    (tmp_path / "building.toml").write_text(SMALL, "utf-8")
    done = menshin("model", "new", "--building", "building.toml", "--direction", direction, "-o", "first.toml")
    assert done.exit_code == 2
    assert "TOWER does not measure direction y; it measures x" in " ".join(done.output.replace("│", "").split())
    assert not Path("first.toml").exists()


def test_a_wrong_building_file_ends_with_two(tmp_path: Path) -> None:
    (tmp_path / "building.toml").write_text(SMALL.replace("k_b", "kb"), "utf-8")
    done = menshin("model", "new", "--building", "building.toml", "-o", "first.toml")
    assert done.exit_code == 2
    assert "isolation.design.kb: no such key; did you mean 'k_b'?" in done.output


def test_every_effect_is_listed_under_its_family() -> None:
    done = menshin("effects")
    assert done.exit_code == 0
    for name, effect in EFFECTS.items():
        assert name in done.output
        assert effect.family in done.output


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_an_effect_is_explained(name: str) -> None:
    done = menshin("effects", name)
    assert done.exit_code == 0
    shown, effect = " ".join(done.output.split()), EFFECTS[name]
    for expected in (effect.title, effect.family, "def law(", *(p.name for p in effect.parameters)):
        assert expected in shown
    assert "{" not in shown.split("def law(")[0]
    assert " ".join(effect.suspect_when.split()) in shown


def test_an_unknown_effect_is_named_with_those_there_are() -> None:
    done = menshin("effects", "magic")
    assert done.exit_code == 2
    assert "there is no effect 'magic'; there are" in " ".join(done.output.replace("│", " ").split())
