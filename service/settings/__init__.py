"""Settings: environment variables (MENSHIN_...) over a TOML file over the defaults.

Most settings belong to a group: `host` of `[smtp]` in the file is `MENSHIN_SMTP__HOST` in the environment and
`smtp.host` where it is shown. The names of development versions, such as `smtp_host`, are still read; every command
warns about them.
"""

import os
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, Literal, Self
from urllib.parse import urlsplit

from platformdirs import user_data_path
from pydantic import Field, field_validator, model_validator
from pydantic.fields import FieldInfo
from pydantic_settings import (
    BaseSettings,
    EnvSettingsSource,
    InitSettingsSource,
    PydanticBaseSettingsSource,
    SettingsConfigDict,
    TomlConfigSettingsSource,
)

from service.addresses import is_loopback
from service.settings.groups import (
    Analysis,
    Count,
    DataHealth,
    Event,
    Group,
    Heartbeat,
    Jobs,
    Login,
    Notify,
    Oidc,
    Parser,
    Polling,
    Retention,
    Seconds,
    Smtp,
    Storage,
    Stream,
    Traces,
    Trigger,
)
from service.settings.names import OLD_NAMES, PREFIX, grouped, variable

FILE_VARIABLE = "MENSHIN_SETTINGS"
KEY_VARIABLE = "MENSHIN_SECRET_KEY"
"""The key of service.db.encryption: not a setting, so that no command shows it."""
DEFAULT_FILE = "menshin.toml"
SECRETS = frozenset(
    {
        *("database_url", "smtp", "smtp.password", "heartbeat", "heartbeat.url", "oidc", "oidc.client_secret"),
        *("storage", "storage.originals", "storage.s3_endpoint", "storage.s3_access_key", "storage.s3_secret_key"),
    }
)
"""Settings, and groups with such settings, whose values no message repeats."""


class Settings(BaseSettings):
    """All settings of the service."""

    model_config = SettingsConfigDict(env_prefix=PREFIX, env_nested_delimiter="__", extra="forbid", frozen=True)

    database_url: str = Field(
        default_factory=lambda: f"sqlite:///{user_data_path('menshin') / 'menshin.sqlite'}",
        description="SQLAlchemy address of the database: sqlite:///file or postgresql://user:password@host/name",
    )
    host: str = Field(default="127.0.0.1", description="address that the API listens on")
    port: int = Field(default=8000, ge=0, le=65535, description="port that the API listens on; 0: any free port")
    public_url: str | None = Field(
        default=None, description="address of the pages, such as https://menshin.example.org; messages link to it"
    )
    log_level: Literal["debug", "info", "warning", "error"] = Field(
        default="info", description="lowest level that is logged"
    )
    log_format: Literal["text", "json"] = Field(
        default="text", description="format of the log: text, or json with one object per line; see running.md"
    )
    trusted_proxies: tuple[str, ...] = Field(
        default=(),
        description="addresses of reverse proxies whose X-Forwarded-For and X-Forwarded-Proto are trusted; see "
        "security.md",
    )
    max_connections: Annotated[int, Field(ge=8)] = Field(
        default=512,
        description="largest number of simultaneous connections to the API; fewer if the limit of open files is low",
    )
    max_dataselect_samples: Count = Field(
        default=30_000_000, description="largest number of samples in an answer of /fdsnws/dataselect"
    )
    progress_timeout: Seconds = Field(
        default=30.0,
        description="seconds without news after which the stream of a job's progress ends; browsers then reconnect",
    )
    effects_folder: Path | None = Field(
        default=None, description="folder with effects of your own, one Python file each; see effects-own.md"
    )
    login: Login = Login()
    oidc: Oidc = Oidc()
    polling: Polling = Polling()
    parser: Parser = Parser()
    event: Event = Event()
    trigger: Trigger = Trigger()
    stream: Stream = Stream()
    jobs: Jobs = Field(default_factory=Jobs)
    analysis: Analysis = Analysis()
    data_health: DataHealth = DataHealth()
    retention: Retention = Retention()
    storage: Storage = Storage()
    smtp: Smtp = Smtp()
    notify: Notify = Notify()
    heartbeat: Heartbeat = Heartbeat()
    traces: Traces = Traces()

    @field_validator("database_url")
    @classmethod
    def _address(cls, address: str) -> str:
        if address.startswith("sqlite:///"):  # any path is valid; SQLAlchemy takes long to import
            return address
        from service.db.problems import wrong_address

        if problem := wrong_address(address):
            raise ValueError(problem)
        return address

    @model_validator(mode="after")
    def _has_address_for_sign_in(self) -> Self:
        if self.oidc.issuer is not None:
            public = urlsplit(self.public_url or "")
            if public.scheme != "https" and not (public.scheme == "http" and is_loopback(public.hostname)):
                raise ValueError(
                    "oidc.issuer needs public_url, the address that the provider sends people back to; it must begin "
                    "with https:// (http:// only on this machine itself)"
                )
        return self

    @classmethod
    def settings_customise_sources(
        cls,
        settings_cls: type[BaseSettings],
        init_settings: PydanticBaseSettingsSource,
        env_settings: PydanticBaseSettingsSource,
        dotenv_settings: PydanticBaseSettingsSource,
        file_secret_settings: PydanticBaseSettingsSource,
    ) -> tuple[PydanticBaseSettingsSource, ...]:
        """Arguments, then the environment, then the file.

        Raises:
            ValueError: a menshin.toml that was only found in the working directory names a folder of code to run.
        """
        arguments = InitSettingsSource(settings_cls, grouped(getattr(init_settings, "init_kwargs", {})))
        file = settings_file()
        if file is None:
            return (arguments, Environment(settings_cls))
        from_file = File(settings_cls, file)
        if "effects_folder" in from_file() and not os.environ.get(FILE_VARIABLE):
            raise ValueError(
                f"{file} of the working directory sets effects_folder, whose files are run as code. If you trust the "
                f"file, name it in {FILE_VARIABLE}, or set {PREFIX}EFFECTS_FOLDER instead."
            )
        return (arguments, Environment(settings_cls), from_file)

    def explained(self) -> tuple["Explained", ...]:
        """Every setting with its current value and the origin of that value."""
        file = settings_file()
        in_environment = dict(_leaves(Environment(type(self))()))
        in_file = {} if file is None else dict(_leaves(File(type(self), file)()))
        given = dict(_leaves(self.model_dump(exclude_unset=True)))

        def origin(name: str) -> str:
            if name not in given:
                return "default"
            if name in in_environment:
                return f"environment {variable(name)}"
            return f"file {file}" if name in in_file else "argument"

        values = dict(_leaves(self.model_dump()))
        return tuple(
            Explained(name, _shown(name, values[name]), origin(name), field.description or "")
            for name, field in settings_by_name().items()
        )


@dataclass(frozen=True, slots=True)
class Explained:
    """One setting with its current value."""

    name: str
    value: str
    """Safe to show: passwords are masked."""
    origin: str
    """Origin of the value: an environment variable, a file, or the default."""
    description: str


class Environment(EnvSettingsSource):
    """Settings from the environment; an old name counts where the new one is absent."""

    def __init__(self, settings_cls: type[BaseSettings]) -> None:
        super().__init__(settings_cls)
        given = {name.lower(): value for name, value in os.environ.items()}
        old = {variable(new): given.get(variable(old).lower()) for old, new in OLD_NAMES.items()}
        new = {name: given.get(name.lower()) for name in map(variable, settings_by_name())}
        self.env_vars = {name.lower(): value for name in new if (value := new[name] or old.get(name)) is not None}


class File(TomlConfigSettingsSource):
    """The settings file; old names are moved to their groups."""

    def __call__(self) -> dict[str, Any]:
        """The settings in the file by group."""
        return grouped(super().__call__())


def settings_file() -> Path | None:
    """The settings file: the one that MENSHIN_SETTINGS names, else menshin.toml in the working directory.

    Raises:
        FileNotFoundError: the file that MENSHIN_SETTINGS names does not exist.
    """
    if named := os.environ.get(FILE_VARIABLE):
        if not Path(named).is_file():
            raise FileNotFoundError(f"{FILE_VARIABLE} names {named}, which is not a file; unset it or create the file")
        return Path(named)
    return Path(DEFAULT_FILE) if Path(DEFAULT_FILE).is_file() else None


def settings_by_name() -> dict[str, FieldInfo]:
    """Every setting by its name, such as `port` or `smtp.host`."""
    named: dict[str, FieldInfo] = {}
    for name, field in Settings.model_fields.items():
        if isinstance(group := field.annotation, type) and issubclass(group, Group):
            named |= {f"{name}.{member}": inner for member, inner in group.model_fields.items()}
        else:
            named[name] = field
    return named


def unknown_variables(environment: Mapping[str, str]) -> tuple[str, ...]:
    """A line for each variable that begins with MENSHIN_ but is not a setting; no line repeats a value."""
    known = {FILE_VARIABLE, KEY_VARIABLE, *map(variable, settings_by_name())}
    unknown = {name for name in environment if name.startswith(PREFIX)} - known - set(map(variable, OLD_NAMES))
    lines = (f"the variable {name} is not a setting and is ignored{_nearest(name, known)}" for name in sorted(unknown))
    return tuple(lines)


def old_names(environment: Mapping[str, str], file: Path | None) -> tuple[str, ...]:
    """A line with the new name for each old one in the environment and in the settings file."""
    in_file = {} if file is None else TomlConfigSettingsSource(Settings, file)()
    variables = (old for old in OLD_NAMES if variable(old) in environment)
    members = (old for old in OLD_NAMES if old in in_file)
    return (
        *(f"the variable {variable(old)} is now called {variable(OLD_NAMES[old])}" for old in variables),
        *(f"the setting {old} in {file} is now called {_in_file(OLD_NAMES[old])}" for old in members),
    )


def _in_file(name: str) -> str:
    group, _, member = name.rpartition(".")
    return f"{member} in [{group}]" if group else member


def _nearest(name: str, known: Collection[str]) -> str:
    names = [one.removeprefix(PREFIX) for one in known]
    near = get_close_matches(name.removeprefix(PREFIX), names, n=1)
    return f"; did you mean {PREFIX}{near[0]}?" if near else "; `menshin settings` lists all settings"


def _leaves(given: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    for name, value in given.items():
        if isinstance(value, Mapping):
            yield from ((f"{name}.{member}", inner) for member, inner in value.items())
        else:
            yield name, value


def _shown(name: str, value: object) -> str:
    if name == "database_url":
        from sqlalchemy.engine import make_url

        return make_url(str(value)).render_as_string(hide_password=True)
    return "" if value is None else str(value)
