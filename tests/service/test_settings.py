"""Settings: precedence of their origins, old names, and completeness of the documentation."""

from pathlib import Path

import pytest
import typer
from pydantic import ValidationError
from typer.testing import CliRunner

from core.concurrency import processors
from core.estimators import ESTIMATORS
from service.cli import app
from service.cli.inputs import current_settings
from service.settings import Settings, old_names, settings_by_name, settings_file, unknown_variables
from service.settings.names import OLD_NAMES, variable

DOCUMENT = Path(__file__).resolve().parents[2] / "docs" / "reference" / "settings.md"


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MENSHIN_SETTINGS", raising=False)


def origins(settings: Settings) -> dict[str, tuple[str, str]]:
    return {setting.name: (setting.value, setting.origin) for setting in settings.explained()}


def test_environment_goes_before_file_and_file_before_default(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "menshin.toml"
    file.write_text("port = 1234\n[polling]\ninterval = 7\n")
    monkeypatch.setenv("MENSHIN_PORT", "4321")
    explained = origins(Settings(analysis={"rate": 200.0}))
    assert explained["port"] == ("4321", "environment MENSHIN_PORT")
    assert explained["polling.interval"] == ("7.0", "file menshin.toml")
    assert explained["analysis.rate"] == ("200.0", "argument")
    assert explained["host"] == ("127.0.0.1", "default")


def test_the_file_that_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "elsewhere.toml"
    monkeypatch.setenv("MENSHIN_SETTINGS", str(file))
    with pytest.raises(FileNotFoundError, match=r"elsewhere\.toml"):
        Settings()
    file.write_text("analysis.band = [0.2, 20.0]\n")
    assert Settings().analysis.band == (0.2, 20.0)


def test_a_file_that_no_one_named_cannot_name_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Else a command in a folder of downloaded records runs what came with them."""
    (tmp_path / "menshin.toml").write_text('effects_folder = "effects"\n')
    with pytest.raises(typer.Exit):
        current_settings()
    assert "run as code" in capsys.readouterr().err
    monkeypatch.setenv("MENSHIN_SETTINGS", str(tmp_path / "menshin.toml"))
    assert Settings().effects_folder == Path("effects")


def test_a_misspelt_password_is_not_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "menshin.toml").write_text('smtp.pasword = "hunter2"\n')
    with pytest.raises(typer.Exit):
        current_settings()
    printed = capsys.readouterr().err
    assert "smtp.pasword" in printed
    assert "smtp.password" in printed
    assert "hunter2" not in printed


def test_passwords_are_masked() -> None:
    explained = origins(Settings(database_url="postgresql://me:secret@host/name"))
    assert explained["database_url"][0] == "postgresql://me:***@host/name"
    grants = ({"group": "a", "role": "viewer"},)
    oidc = {"issuer": "https://a.example", "client_id": "b", "client_secret": "s3cr3t", "grants": grants}
    explained = origins(Settings(public_url="https://c.example", oidc=oidc))
    assert "s3cr3t" not in str(explained)
    assert "'group': 'a'" in explained["oidc.grants"][0]


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("prot = 1", "prot"),
        ("analysis.band = [20.0, 0.2]", "band must rise"),
        ('smtp.user = "menshin"', "smtp.user and smtp.password go together"),
        ("smtp.prot = 1", "prot"),
        ("port = 70000", "port"),
        ('jobs.executor = "dask"', "dask_address"),
        ('jobs.dask_tls_ca = "ca.pem"', "go together"),
        (
            'jobs = {dask_address = "tcp://a:1", dask_tls_ca = "a", dask_tls_certificate = "b", dask_tls_key = "c"}',
            "begins with tls://",
        ),
        ("trigger.off = 9.0", "trigger.off must be below"),
        ('analysis.estimator = "kalman"', "'smoother' or 'cms'"),
    ],
)
def test_a_wrong_file_is_refused_by_key(tmp_path: Path, text: str, wanted: str) -> None:
    (tmp_path / "menshin.toml").write_text(text)
    with pytest.raises(ValidationError, match=wanted):
        Settings()


def test_every_estimator_may_be_set() -> None:
    assert {Settings(analysis={"estimator": name}).analysis.estimator for name in ESTIMATORS} == set(ESTIMATORS)


def test_every_setting_is_documented_with_its_meaning() -> None:
    document = DOCUMENT.read_text()
    old = {new: name for name, new in OLD_NAMES.items()}
    for name, field in settings_by_name().items():
        assert f"| `{name}` | {f'`{old[name]}`' if name in old else ''} |" in document, name
        assert (field.description or "?") in document, name


def test_an_analysis_runs_on_each_processor_unless_a_number_is_set() -> None:
    assert Settings().jobs.processes == processors()
    assert Settings(jobs={"workers": 7}).jobs.processes == 7


@pytest.mark.parametrize(
    "text",
    [
        'smtp_password = "s3cr3t"',
        'smtp.password = "s3cr3t"',
        "smtp.password = 5123",
        "oidc.client_secret = 5123",
        'oidc.client_secret = "s3cr3t"\noidc.client_id = "a"',
        'smtp = "s3cr3t"',
        'heartbeat = "s3cr3t"',
        'database_url = "s3cr3t"\njobs.workers = 0',
    ],
)
def test_no_message_of_a_command_repeats_a_secret(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], text: str
) -> None:
    (tmp_path / "menshin.toml").write_text(text)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(typer.Exit):
        current_settings()
    printed = capsys.readouterr().err
    assert printed
    assert "s3cr3t" not in printed
    assert "5123" not in printed


def value_of(settings: Settings, name: str) -> object:
    value: object = settings
    for part in name.split("."):
        value = getattr(value, part)
    return value


EXAMPLES = {"rate": "300", "band": "[1.0, 2.0]", "executor": '"dask"', "estimator": '"cms"', "smtp_security": '"tls"'}
TEXTS = ("smtp_host", "smtp_user", "smtp_password", "mail_from", "dask_address", "heartbeat_url")
WITH = {"executor": "dask_address = 'a'\n", "smtp_user": "smtp_password = 'a'\n", "smtp_password": "smtp_user = 'a'\n"}


@pytest.mark.parametrize("old", sorted(OLD_NAMES))
def test_an_old_name_in_the_file_is_read_and_its_new_name_reported(tmp_path: Path, old: str) -> None:
    example = EXAMPLES.get(old, '"text"' if old in TEXTS else "true" if old.startswith("plain") else "2")
    example = '["a"]' if old == "inside_allowed" else "100_000_000" if old == "parser_memory" else example
    (tmp_path / "menshin.toml").write_text(f"{WITH.get(old, '')}{old} = {example}\n")
    explained = origins(Settings())
    assert explained[OLD_NAMES[old]][1] == "file menshin.toml"
    group, _, member = OLD_NAMES[old].rpartition(".")
    lines = old_names({}, settings_file())
    assert any(f"{old} in menshin.toml is now called {member}" in line and group in line for line in lines)


@pytest.mark.parametrize(
    ("old", "text", "value"),
    [
        ("smtp_host", "mail.example.org", "mail.example.org"),
        ("inside_allowed", '["a"]', ("a",)),
        ("progress_patience", "3", 3.0),
        ("band", "[0.2, 20]", (0.2, 20.0)),
    ],
)
def test_an_old_name_in_the_environment_goes_before_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, old: str, text: str, value: object
) -> None:
    (tmp_path / "menshin.toml").write_text(
        "progress_timeout = 5\n[smtp]\nhost = 'other'\nport = 25\n[notify]\nallowed_private_hosts = ['b']\n"
    )
    monkeypatch.setenv(variable(old), text)
    settings = Settings()
    assert value_of(settings, OLD_NAMES[old]) == value
    assert settings.smtp.port == 25
    assert old_names({variable(old): text}, None) == (
        f"the variable {variable(old)} is now called {variable(OLD_NAMES[old])}",
    )
    assert unknown_variables({variable(old): text}) == ()
    monkeypatch.setenv(variable(OLD_NAMES[old]), "[]" if isinstance(value, tuple) and value == ("a",) else text)
    assert value_of(Settings(), OLD_NAMES[old]) == (() if value == ("a",) else value)


def test_a_command_warns_of_old_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "menshin.toml").write_text("poll_interval = 7\n")
    monkeypatch.setenv("MENSHIN_WORKERS", "1")
    done = CliRunner().invoke(app, ["settings"])
    assert done.exit_code == 0
    assert done.stderr.splitlines() == [
        "warning: the variable MENSHIN_WORKERS is now called MENSHIN_JOBS__WORKERS",
        "warning: the setting poll_interval in menshin.toml is now called interval in [polling]",
    ]
