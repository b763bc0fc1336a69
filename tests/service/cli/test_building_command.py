from pathlib import Path

import pytest
from building_files import SMALL
from click.testing import Result
from typer.testing import CliRunner

from service.cli import app

pytestmark = pytest.mark.sqlite


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, empty_database_url: str) -> Path:
    """Folder of the building file; the commands run on a database without tables."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MENSHIN_SETTINGS", raising=False)
    monkeypatch.setenv("MENSHIN_DATABASE_URL", empty_database_url)
    (tmp_path / "building.toml").write_text(SMALL, "utf-8")
    return tmp_path


def building(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["building", *map(str, arguments)])


def test_a_building_is_added_listed_shown_and_updated(folder: Path) -> None:
    file = folder / "building.toml"
    assert building("add", file).exit_code == 0
    assert "TOWER" in building("list").output
    assert building("show", "TOWER").output == SMALL
    heavier = SMALL.replace("mass = 2.3e6", "mass = 2.4e6")
    file.write_text(heavier, "utf-8")
    assert "revision 2" in building("update", "TOWER", file).output
    assert building("show", "TOWER").output == heavier


def test_a_name_is_printed_as_it_is_and_in_full(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Square brackets are not taken for markup, and a word that is longer than its column is folded."""
    monkeypatch.setenv("COLUMNS", "80")
    name = "Tower [north] [/b] Taumatawhakatangihangakoauauotamateaturipukakapiki"
    text = (folder / "building.toml").read_text("utf-8")
    own = next(line for line in text.splitlines() if line.startswith("name = "))
    (folder / "building.toml").write_text(text.replace(own, f'name = "{name}"', 1), "utf-8")
    assert building("add", folder / "building.toml").output.startswith(f"TOWER is monitored: {name}\n")
    cells = [line.split("│")[2].strip() for line in building("list").output.splitlines() if "│" in line]
    assert "".join(cells).replace(" ", "") == name.replace(" ", "")


def test_the_same_description_again_is_no_new_revision(folder: Path) -> None:
    building("add", folder / "building.toml")
    assert "revision 1" in building("update", "TOWER", folder / "building.toml").output


def test_a_building_is_added_once(folder: Path) -> None:
    building("add", folder / "building.toml")
    again = building("add", folder / "building.toml")
    assert again.exit_code == 1
    assert "exists already" in again.output


def test_a_wrong_file_adds_nothing_and_lists_every_problem(folder: Path) -> None:
    wrong = SMALL.replace("mass = 2.3e6", "mass = -1.0").replace('"Asia/Tokyo"', '"Mars"')
    (folder / "building.toml").write_text(wrong, "utf-8")
    done = building("add", folder / "building.toml")
    assert done.exit_code == 1
    assert done.output.startswith(f"{folder / 'building.toml'}:\n")
    assert "timezone: 'Mars' is not a time zone" in done.output
    assert "level[4].mass: input should be greater than 0, got -1.0" in done.output
    assert "TOWER" not in building("list").output


@pytest.mark.parametrize("command", [("show", "NONE"), ("update", "NONE", "building.toml")])
def test_an_unknown_building_is_refused_with_those_that_are_known(folder: Path, command: tuple[str, ...]) -> None:
    building("add", folder / "building.toml")
    done = building(*command)
    assert done.exit_code == 1
    assert "no building 'NONE'; there are: TOWER" in done.output


def test_a_building_is_not_updated_with_another_ones_file(folder: Path) -> None:
    building("add", folder / "building.toml")
    (folder / "other.toml").write_text(SMALL.replace('"TOWER"', '"OTHER"'), "utf-8")
    done = building("update", "TOWER", "other.toml")
    assert done.exit_code == 1
    assert "describes building 'OTHER'; name a file of 'TOWER'" in done.output
    assert building("show", "TOWER").output == SMALL


def test_wrong_settings_end_with_two_and_their_name(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MENSHIN_PORT", "many")
    done = building("list")
    assert done.exit_code == 2
    assert "port: " in done.output


SOURCE = 'kind = "folder"\nlocation = "records"'


@pytest.mark.parametrize("kind", ["archive", "fdsnws"])
def test_a_source_with_an_address_that_is_none_is_refused(folder: Path, kind: str) -> None:
    assert SOURCE in SMALL
    wrong = SMALL.replace(SOURCE, f'kind = "{kind}"\nlocation = "htp://alice:s3cret@host/x"')
    (folder / "building.toml").write_text(wrong, "utf-8")
    done = building("add", folder / "building.toml")
    assert done.exit_code == 1
    assert "source.location: this is not a web address: it begins with 'htp:'; http://host/path" in done.output
    assert "s3cret" not in done.output
    assert "TOWER" not in building("list").output


def test_a_folder_that_is_missing_is_warned_of(folder: Path) -> None:
    done = building("add", folder / "building.toml")
    assert done.exit_code == 0
    assert f"warning: the folder {folder / 'records'} does not exist" in done.stderr
    (folder / "records").mkdir()
    assert building("update", "TOWER", folder / "building.toml").stderr == ""


def test_mail_receivers_without_a_mail_server_are_warned_of(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    receiver = '[[receiver]]\nname = "me"\nkind = "email"\naddress = "me@example.org"\n'
    (folder / "building.toml").write_text(f"{SMALL}\n{receiver}", "utf-8")
    assert "set smtp.host" in building("add", folder / "building.toml").stderr
    monkeypatch.setenv("MENSHIN_SMTP__HOST", "127.0.0.1")
    assert "smtp.host" not in building("update", "TOWER", folder / "building.toml").stderr
