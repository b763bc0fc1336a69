"""Settings: which one is in force, why, and that all are documented."""

from pathlib import Path

import pytest
import typer
from pydantic import ValidationError

from core.estimators import ESTIMATORS
from service.cli.current_settings import settings_in_force
from service.settings import Settings

DOCUMENT = Path(__file__).resolve().parents[2] / "docs" / "reference" / "settings.md"


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MENSHIN_SETTINGS", raising=False)


def origins(settings: Settings) -> dict[str, tuple[str, str]]:
    return {setting.name: (setting.value, setting.origin) for setting in settings.explained()}


def test_environment_goes_before_file_and_file_before_default(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "menshin.toml"
    file.write_text("port = 1234\npoll_interval = 7\n")
    monkeypatch.setenv("MENSHIN_PORT", "4321")
    explained = origins(Settings(rate=200.0))
    assert explained["port"] == ("4321", "environment MENSHIN_PORT")
    assert explained["poll_interval"] == ("7.0", "file menshin.toml")
    assert explained["rate"] == ("200.0", "argument")
    assert explained["host"] == ("127.0.0.1", "default")


def test_the_file_that_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "elsewhere.toml"
    monkeypatch.setenv("MENSHIN_SETTINGS", str(file))
    with pytest.raises(FileNotFoundError, match=r"elsewhere\.toml"):
        Settings()
    file.write_text("band = [0.2, 20.0]\n")
    assert Settings().band == (0.2, 20.0)


def test_a_file_that_nobody_named_cannot_name_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Else a command in a folder of downloaded records runs what came with them."""
    (tmp_path / "menshin.toml").write_text('effects_folder = "effects"\n')
    with pytest.raises(typer.Exit):
        settings_in_force()
    assert "run as code" in capsys.readouterr().err
    monkeypatch.setenv("MENSHIN_SETTINGS", str(tmp_path / "menshin.toml"))
    assert Settings().effects_folder == Path("effects")


def test_a_misspelt_password_is_not_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "menshin.toml").write_text('smtp_pasword = "hunter2"\n')
    with pytest.raises(typer.Exit):
        settings_in_force()
    printed = capsys.readouterr().err
    assert "smtp_pasword" in printed
    assert "hunter2" not in printed


def test_passwords_are_masked() -> None:
    explained = origins(Settings(database_url="postgresql://me:secret@host/name"))
    assert explained["database_url"][0] == "postgresql://me:***@host/name"


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("prot = 1", "prot"),
        ("band = [20.0, 0.2]", "band must rise"),
        ('smtp_user = "menshin"', "smtp_user and smtp_password go together"),
        ("port = 70000", "port"),
        ('executor = "dask"', "dask_address"),
        ("trigger_off = 9.0", "trigger_off must be below"),
        ('estimator = "kalman"', "'smoother' or 'cms'"),
    ],
)
def test_a_wrong_file_is_refused_by_key(tmp_path: Path, text: str, wanted: str) -> None:
    (tmp_path / "menshin.toml").write_text(text)
    with pytest.raises(ValidationError, match=wanted):
        Settings()


def test_every_estimator_may_be_set() -> None:
    assert {Settings(estimator=name).estimator for name in ESTIMATORS} == set(ESTIMATORS)


def test_every_setting_is_documented_with_its_meaning() -> None:
    document = DOCUMENT.read_text()
    for name, field in Settings.model_fields.items():
        assert f"| `{name}` |" in document, name
        assert (field.description or "?") in document, name


@pytest.mark.parametrize(
    "text", ['smtp_password = "s3cr3t"', "smtp_password = 5123", 'database_url = "s3cr3t"\nworkers = 0']
)
def test_no_message_of_a_command_repeats_a_secret(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], text: str
) -> None:
    (tmp_path / "menshin.toml").write_text(text)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(typer.Exit):
        settings_in_force()
    said = capsys.readouterr().err
    assert said
    assert "s3cr3t" not in said
    assert "5123" not in said
