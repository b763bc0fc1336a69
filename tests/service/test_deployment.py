"""The files of an installation: image, Compose file, settings for both, systemd units; without a container engine."""

import json
import os
import re
import shlex
import shutil
import subprocess
from collections.abc import Iterator, Mapping
from fnmatch import fnmatch
from importlib.metadata import requires
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
import typer
import write_environment
import yaml
from compose_spec import PyCompose
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from typer.core import TyperGroup

from service.cli import app
from service.settings import FILE_VARIABLE, KEY_VARIABLE, Settings, settings_by_name
from service.settings.names import variable

ROOT = Path(__file__).resolve().parents[2]
DOCKER = ROOT / "docker"
EXAMPLE = DOCKER / "menshin.env.example"
VARIABLES = {FILE_VARIABLE, KEY_VARIABLE, *map(variable, settings_by_name())}
COMMANDS = set(typer.main.get_command(app).commands)  # type: ignore[attr-defined]
DIGEST = re.compile(r"@sha256:[0-9a-f]{64}$")
OF_THE_IMAGE = frozenset({"dask", "s3", "traces"})
"""Extras that the image has."""
KUBERNETES = "1.31"
"""Version whose schemas the manifests follow."""
CERTIFICATES = {f"/certificates/{name}.pem" for name in ("ca", "certificate", "key")}
SYSTEMD = shutil.which("systemd-analyze")


@pytest.fixture(scope="module")
def compose() -> dict[str, Any]:
    """The Compose file, with its anchors filled in, as Compose itself understands it."""
    text = (DOCKER / "compose.yaml").read_text("utf-8").replace("${POSTGRES_PASSWORD:?choose one}", "secret")
    filled = yaml.safe_load(text.replace("${MENSHIN_RECORDS:-./records}", "./records"))
    read = PyCompose.from_json(json.dumps(filled))
    read.validate()
    document: dict[str, Any] = json.loads(read.to_json())
    return document


def parts(compose: Mapping[str, Any]) -> dict[str, Any]:
    return {name: one for name, one in compose["services"].items() if name != "postgres"}


def test_every_part_runs_without_rights_and_says_whether_it_lives(compose: dict[str, Any]) -> None:
    assert set(parts(compose)) == {"api", "poll", "work", "notify"}
    for name, part in parts(compose).items():
        assert part["command"] == [name]
        assert name in COMMANDS
        assert part["read_only"] is True
        assert part["cap_drop"] == ["ALL"]
        assert part["security_opt"] == ["no-new-privileges:true"]
        assert any(volume["target"] == "/data" for volume in map(mounted, part["volumes"])), "the one place to write"
        assert part["depends_on"]["postgres"]["condition"] == "service_healthy"
        if name != "api":  # the image's own
            process = {"poll": "poller", "work": "worker", "notify": "notifier"}[name]
            assert part["healthcheck"]["test"] == ["CMD", "menshin", "doctor", "--only", process]
    assert compose["services"]["postgres"]["healthcheck"]


def mounted(volume: object) -> Mapping[str, str]:
    if isinstance(volume, str):
        source, target, *_ = volume.split(":")
        return {"source": source, "target": target}
    assert isinstance(volume, Mapping)
    return volume


def test_the_compose_file_passes_every_setting(compose: dict[str, Any]) -> None:
    for part in parts(compose).values():
        assert "menshin.env" in str(part["env_file"])
        assert {name for name in part["environment"] if name.startswith("MENSHIN_")} <= VARIABLES
    listed = re.findall(r"^#?(MENSHIN_\w+)=", EXAMPLE.read_text("utf-8"), re.MULTILINE)
    assert set(listed) == VARIABLES - {FILE_VARIABLE}
    assert len(listed) == len(set(listed))


def test_the_example_of_all_settings_is_up_to_date() -> None:
    written = write_environment.document()
    assert EXAMPLE.read_text("utf-8") == written, "python docs/tools/write_environment.py would mend it"


def test_the_values_of_the_example_are_the_defaults(monkeypatch: pytest.MonkeyPatch, own_settings: None) -> None:
    for name in [name for name in os.environ if name.startswith("MENSHIN_")]:
        monkeypatch.delenv(name)
    before = Settings().model_dump()
    for name, value in re.findall(r"^#(MENSHIN_\w+)=(.+)$", EXAMPLE.read_text("utf-8"), re.MULTILINE):
        monkeypatch.setenv(name, value)
    assert Settings().model_dump() == before


def instructions(name: str) -> Iterator[str]:
    """The arguments of the instructions of this name in the Dockerfile."""
    text = (DOCKER / "Dockerfile").read_text("utf-8").replace("\\\n", " ")
    yield from (line.partition(" ")[2].strip() for line in text.splitlines() if line.startswith(f"{name} "))


def test_images_are_named_by_their_digest_and_run_as_nobody_special(compose: dict[str, Any]) -> None:
    bases = [line.split(" AS ")[0] for line in instructions("FROM")]
    assert len(bases) == 2
    assert all(DIGEST.search(one) for one in (*bases, compose["services"]["postgres"]["image"]))
    assert list(instructions("USER")) == ["10001:10001"]
    (variables,) = instructions("ENV")
    assert set(re.findall(r"MENSHIN_\w+(?==)", variables)) <= VARIABLES


def test_what_the_image_copies_is_there_and_sent_to_the_engine() -> None:
    sent = [line[1:] for line in (ROOT / ".dockerignore").read_text().splitlines() if line.startswith("!")]
    copied = [one for line in instructions("COPY") if "--from" not in line for one in line.split()[:-1]]
    assert len(copied) > 5
    for one in copied:
        assert (ROOT / one).exists(), one
        assert any(fnmatch(one, pattern) for pattern in sent), one


ENTRY = re.compile(r"^([A-Za-z0-9._-]+)==(\S+)[^\n]*((?:\n    --hash=\S+(?: \\)?)+)", re.MULTILINE)


def locked(path: Path) -> set[tuple[str, str, frozenset[str]]]:
    """Name, version and hashes of every package of a lock file."""
    entries = ENTRY.findall(path.read_text())
    return {(canonicalize_name(n), v, frozenset(re.findall(r"sha256:\w+", hashes))) for n, v, hashes in entries}


def required(name: str, extras: frozenset[str], known: set[tuple[str, frozenset[str]]]) -> None:
    """Add what a package requires here, and what that requires, to the known packages with their extras."""
    for one in map(Requirement, requires(name) or ()):
        key = (canonicalize_name(one.name), frozenset(one.extras))
        if key not in known and (not one.marker or any(one.marker.evaluate({"extra": e}) for e in {"", *extras})):
            known.add(key)
            required(*key, known)


def test_the_image_has_what_runs_menshin_and_nothing_else() -> None:
    """It has the tested versions of what the package and its extras for operation require."""
    image, known = locked(DOCKER / "requirements.lock"), set[tuple[str, frozenset[str]]]()
    assert image <= locked(ROOT / "requirements.lock")
    required("menshin", OF_THE_IMAGE, known)
    assert {name for name, _, _ in image} == {name for name, _ in known}


COMMANDS_OF_UNITS = {
    "menshin.service": "menshin up",
    "menshin@.service": "menshin %i",
    "menshin-dask-scheduler.service": "dask scheduler",
    "menshin-dask-worker@.service": "dask worker ${SCHEDULER}",
}


@pytest.mark.parametrize("unit", COMMANDS_OF_UNITS)
def test_systemd_accepts_the_units_and_finds_them_confined(unit: str, tmp_path: Path) -> None:
    text = (DOCKER / "systemd" / unit).read_text("utf-8")
    assert set(re.findall(r"^Environment=(MENSHIN_\w+)", text, re.MULTILINE)) <= VARIABLES
    (command,) = re.findall(r"^ExecStart=/opt/menshin/bin/(.+)$", text, re.MULTILINE)
    assert command.startswith(COMMANDS_OF_UNITS[unit])
    assert ("menshin.env" in text) == command.startswith("menshin"), "secrets stay with those who need them"
    for part in re.findall(r"menshin@(\w+)", text):
        assert part in COMMANDS
    if SYSTEMD is None:
        pytest.skip("systemd-analyze is not installed")
    copy = tmp_path / unit.replace("@.", "@poll.")
    copy.write_text(re.sub(r"/opt/menshin/bin/\w+", "/bin/true", text))
    verified = subprocess.run([SYSTEMD, "verify", copy], capture_output=True, text=True)
    assert (verified.returncode, verified.stderr) == (0, "")
    judged = subprocess.run(
        [SYSTEMD, "security", "--offline=yes", "--threshold=20", copy], capture_output=True, text=True
    )
    assert judged.returncode == 0, judged.stdout[-2000:]  # exposure 1.6 of 10, measured


HEADS = ("compose.yaml", "kubernetes/menshin.yaml", "systemd/menshin.service", "systemd/menshin@.service")
NEEDED = {"login", "key create NAME --role admin", "building add FILE", "doctor"}
"""Commands that every installation needs after its start."""
IN_TEXT = re.compile(r"^ *(?:docker compose .* api |kubectl .* -- )?menshin (\w[^<\n]*)", re.MULTILINE)
AS_SERVICE = re.compile(r"^menshin\(\) \{\n  systemd-run (.*?) \S+/menshin \"\$@\"\n\}$", re.MULTILINE | re.DOTALL)

OF_COMMANDS = ("User=", "Group=", "UMask=", "WorkingDirectory=", "Environment=", "EnvironmentFile=")
"""Properties of a unit that its commands need."""


def head(name: str) -> str:
    """The comment at the head of a file of an installation."""
    lines = (DOCKER / name).read_text("utf-8").splitlines()
    return "\n".join(line[1:].removeprefix("   ") for line in lines if line.startswith("#"))


def running() -> str:
    """The document on installations, without the indentation of its commands."""
    text = (ROOT / "docs" / "operate" / "running.md").read_text("utf-8")
    return re.sub("^    ", "", text, flags=re.MULTILINE)


def commands(text: str) -> list[list[str]]:
    """Arguments of the `menshin ...` that the lines of a text run."""
    return [shlex.split(found, comments=True) for found in IN_TEXT.findall(text)]


@pytest.mark.parametrize("name", [*HEADS, None])
def test_every_installation_says_how_to_log_in_and_to_add_a_building(name: str | None) -> None:
    found = commands(running() if name is None else head(name))
    assert {" ".join("FILE" if one.startswith("/") else one for one in each) for each in found} >= NEEDED
    for arguments in found:
        command, rest = typer.main.get_command(app), [str(EXAMPLE) if one[0] == "/" else one for one in arguments]
        while isinstance(command, TyperGroup):
            command = command.commands[rest.pop(0)]
        command.make_context("menshin", rest)  # as the command line does, or it raises


@pytest.mark.parametrize("unit", [name for name in HEADS if name.startswith("systemd")])
def test_commands_have_account_and_environment_of_the_units(unit: str) -> None:
    (given,) = AS_SERVICE.findall(head(unit))
    assert AS_SERVICE.findall(running()) == [given]
    options = shlex.split(given.replace("\\\n", " "))
    properties = {value for name, value in pairwise(options) if name == "-p"}
    lines = (DOCKER / unit).read_text("utf-8").splitlines()
    assert properties == {line for line in lines if line.startswith(OF_COMMANDS)}
    if (program := shutil.which("systemd-run")) is None:
        pytest.skip("systemd-run is not installed")
    helped = subprocess.run([program, "--help"], capture_output=True, text=True, check=True).stdout
    assert all(one in helped.split() for one in options if one.startswith("--"))


@pytest.fixture(scope="module")
def manifests() -> list[dict[str, Any]]:
    """The objects for Kubernetes."""
    return list(yaml.safe_load_all((DOCKER / "kubernetes" / "menshin.yaml").read_text("utf-8")))


def test_kubernetes_accepts_the_manifests(manifests: list[dict[str, Any]]) -> None:
    from kubernetes_validate import validate

    for one in manifests:
        validate(one, KUBERNETES, strict=True)
    assert [one["kind"] for one in manifests] == ["Service"] * 2 + ["Deployment"] * 6 + ["NetworkPolicy"]


def test_pods_run_without_rights_and_those_of_dask_without_settings(manifests: list[dict[str, Any]]) -> None:
    pods = {one["metadata"]["name"]: one["spec"] for one in manifests if one["kind"] == "Deployment"}
    services = {one["metadata"]["name"]: one["spec"]["selector"] for one in manifests if one["kind"] == "Service"}
    for name, deployed in pods.items():
        labels, pod = deployed["template"]["metadata"]["labels"], deployed["template"]["spec"]
        (container,) = pod["containers"]
        assert deployed["selector"]["matchLabels"].items() <= labels.items()
        assert pod["securityContext"]["runAsUser"] == 10001, "the image's"
        assert pod["enableServiceLinks"] is False
        assert container["securityContext"]["readOnlyRootFilesystem"] is True
        assert container["securityContext"]["capabilities"] == {"drop": ["ALL"]}
        given = {one["name"] for one in container.get("env", ())}
        secrets = {one["secretRef"]["name"] for one in container.get("envFrom", ())}
        if name.startswith("dask-"):
            assert not secrets, "neither settings nor a database"
            assert not any(one.startswith("MENSHIN_") for one in given)
            assert labels["cluster"] == "dask", "what the network policy selects"
        else:
            assert container["command"] == ["menshin", name]
            assert name in COMMANDS
            assert secrets == {"menshin"}
            assert given <= VARIABLES
    for name, selector in services.items():
        assert selector.items() <= pods[name]["template"]["metadata"]["labels"].items()


def test_dask_in_kubernetes_understands_its_commands_and_variables(manifests: list[dict[str, Any]]) -> None:
    import dask
    from dask.config import collect_env
    from distributed import Security
    from distributed.cli import dask_scheduler, dask_worker

    pods = {
        one["metadata"]["name"]: one["spec"]["template"]["spec"] for one in manifests if one["kind"] == "Deployment"
    }
    for name, command, role in (
        ("dask-scheduler", dask_scheduler.main, "scheduler"),
        ("dask-worker", dask_worker.main, "worker"),
    ):
        (container,) = pods[name]["containers"]
        command.make_context(name, list(container["command"][2:]))  # as the command line does, or it raises
        tls = collect_env({one["name"]: one["value"] for one in container["env"]})["distributed"]["comm"]["tls"]
        files = {"ca_file": tls["ca_file"]} | {f"{role}.{file}": path for file, path in tls[role].items()}
        with dask.config.set({f"distributed.comm.tls.{file}": path for file, path in files.items()}):
            found = Security().get_tls_config_for_role(role)
        assert {found[file] for file in ("ca_file", "cert", "key")} == CERTIFICATES
    (work,) = pods["work"]["containers"]
    given = {one["name"]: one["value"] for one in work["env"]}
    assert {value for name, value in given.items() if "DASK_TLS" in name} == CERTIFICATES
    address = pods["dask-worker"]["containers"][0]["command"][2]
    assert given["MENSHIN_JOBS__DASK_ADDRESS"] == address == "tls://dask-scheduler:8786"
