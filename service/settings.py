"""Settings: environment variables (MENSHIN_...) over a TOML file over the defaults.

Most settings belong to a group: `host` of `[smtp]` in the file is `MENSHIN_SMTP__HOST` in the environment and
`smtp.host` where it is shown. The names of development versions, such as `smtp_host`, are still read; every command
warns of them.
"""

import os
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from platformdirs import user_data_path
from pydantic import BaseModel, ConfigDict, Field, SecretStr, field_validator, model_validator
from pydantic.fields import FieldInfo
from pydantic_settings import (
    BaseSettings,
    EnvSettingsSource,
    InitSettingsSource,
    PydanticBaseSettingsSource,
    SettingsConfigDict,
    TomlConfigSettingsSource,
)
from sqlalchemy.engine import make_url

from service.db.problems import wrong_address

PREFIX = "MENSHIN_"
FILE_VARIABLE = "MENSHIN_SETTINGS"
KEY_VARIABLE = "MENSHIN_SECRET_KEY"
"""The key of service.db.encryption: not a setting, so that no command shows it."""
DEFAULT_FILE = "menshin.toml"
SECRETS = frozenset({"database_url", "smtp", "smtp.password", "heartbeat", "heartbeat.url"})
"""Settings, and groups that hold one, whose values no message repeats."""
OLD_NAMES: Mapping[str, str] = {
    "login_idle": "login.idle_timeout",
    "login_lifetime": "login.lifetime",
    "progress_patience": "progress_timeout",
    "poll_interval": "polling.interval",
    "source_concurrency": "polling.concurrency",
    "http_timeout": "polling.timeout",
    "http_retries": "polling.retries",
    "retry_delay": "polling.retry_delay",
    "max_answer_bytes": "polling.max_answer_bytes",
    "late_data": "polling.late_data",
    "settle_time": "polling.settle_time",
    "parser_time": "parser.time_limit",
    "parser_memory": "parser.memory_limit",
    "event_grace": "event.grace",
    "event_tolerance": "event.tolerance",
    "longest_event": "event.longest",
    "trigger_short": "trigger.short_window",
    "trigger_long": "trigger.long_window",
    "trigger_on": "trigger.on",
    "trigger_off": "trigger.off",
    "trigger_channels": "trigger.channels",
    "trigger_floor": "trigger.floor",
    "trigger_before": "trigger.before",
    "trigger_after": "trigger.after",
    "workers": "jobs.workers",
    "lease": "jobs.lease",
    "job_attempts": "jobs.attempts",
    "job_time_limit": "jobs.time_limit",
    "executor": "jobs.executor",
    "dask_address": "jobs.dask_address",
    "estimator": "analysis.estimator",
    "rate": "analysis.rate",
    "band": "analysis.band",
    "check_interval": "data_health.interval",
    "source_patience": "data_health.source_timeout",
    "continuous_patience": "data_health.continuous_timeout",
    "quiet_patience": "data_health.event_silence_timeout",
    "channel_misses": "data_health.channel_misses",
    "rejected_age": "data_health.rejected_age",
    "clock_tolerance": "data_health.clock_tolerance",
    "worker_patience": "data_health.worker_timeout",
    "disk_reserve": "data_health.disk_reserve",
    "smtp_host": "smtp.host",
    "smtp_port": "smtp.port",
    "smtp_security": "smtp.security",
    "smtp_user": "smtp.user",
    "smtp_password": "smtp.password",
    "mail_from": "smtp.sender",
    "message_age": "notify.max_event_age",
    "reminder_interval": "notify.reminder_interval",
    "inside_allowed": "notify.allowed_private_hosts",
    "plain_http_allowed": "notify.allow_plain_http",
    "notice_timeout": "notify.timeout",
    "notice_attempts": "notify.attempts",
    "notice_delay": "notify.retry_delay",
    "notice_longest_delay": "notify.longest_delay",
    "alertmanager_interval": "notify.alertmanager_interval",
    "heartbeat_url": "heartbeat.url",
    "heartbeat_interval": "heartbeat.interval",
}
"""The names of development versions, with the settings that they stand for."""

Seconds = Annotated[float, Field(gt=0)]
Count = Annotated[int, Field(ge=1)]


class Group(BaseModel):
    """Settings of one subject: a table of the TOML file."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Login(Group):
    """Browser sessions."""

    idle_timeout: Seconds = Field(
        default=43_200.0, description="s without a request after which a browser must log in again"
    )
    lifetime: Seconds = Field(default=604_800.0, description="s after which a browser must log in again in any case")


class Polling(Group):
    """Requests to monitoring servers."""

    interval: Seconds = Field(default=60.0, description="s between two polls of a source")
    concurrency: Count = Field(default=4, description="simultaneous requests to one source")
    timeout: Seconds = Field(default=30.0, description="s without a byte after which a request is given up")
    retries: int = Field(default=3, ge=0, description="repetitions of a failed request, at growing intervals")
    retry_delay: Seconds = Field(
        default=1.0, description="s before the first repetition; each further one waits twice as long"
    )
    max_answer_bytes: Count = Field(
        default=256 * 2**20, description="bytes of the largest file or answer that is accepted"
    )
    late_data: float = Field(
        default=3600.0, ge=0, description="s for which data that a server (fdsnws) does not have yet is requested again"
    )
    settle_time: float = Field(
        default=2.0, ge=0, description="s that a file must have been left unchanged before it is read"
    )


class Parser(Group):
    """Limits of the process that reads one file."""

    time_limit: Seconds = Field(
        default=30.0, description="s of processor time, or twice as many on the clock, that reading one file may take"
    )
    memory_limit: Annotated[int, Field(ge=2**26)] = Field(
        default=2 * 2**30, description="bytes of memory that reading one file may take"
    )


class Event(Group):
    """Files that belong to one earthquake."""

    grace: float = Field(
        default=120.0, ge=0, description="s after its last file that an event waits for missing channels"
    )
    tolerance: float = Field(
        default=5.0, ge=0, description="s between two files that may still belong to one earthquake"
    )
    longest: Seconds = Field(
        default=10_800.0,
        description="s, longest earthquake: longer records of events are rejected, and longer windows of continuous "
        "ones are cut",
    )


class Trigger(Group):
    """The STA/LTA trigger for continuous records."""

    short_window: Seconds = Field(default=1.0, description="s, short-term window of the STA/LTA trigger")
    long_window: Seconds = Field(default=30.0, description="s, long-term window of the STA/LTA trigger")
    on: Annotated[float, Field(gt=1)] = Field(default=4.0, description="STA/LTA ratio that begins an event")
    off: Annotated[float, Field(gt=0)] = Field(default=1.5, description="STA/LTA ratio that ends an event")
    channels: Count = Field(default=2, description="channels that must trigger together")
    floor: float = Field(default=0.005, ge=0, description="m/s², smallest peak acceleration of an event")
    before: Seconds = Field(default=30.0, description="s kept before a trigger")
    after: Seconds = Field(default=60.0, description="s kept after a trigger")

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.off >= self.on:
            raise ValueError(f"trigger.off must be below trigger.on, got {self.off} and {self.on}")
        if self.short_window >= self.long_window:
            raise ValueError(
                f"trigger.short_window must be below trigger.long_window, got {self.short_window} and "
                f"{self.long_window} s"
            )
        return self


class Jobs(Group):
    """Where and how jobs are computed."""

    workers: Count = Field(default_factory=lambda: os.cpu_count() or 1, description="simultaneous analyses")
    lease: Seconds = Field(default=120.0, description="s after which a silent worker's job is given to another one")
    attempts: Count = Field(default=3, description="attempts after which a job counts as failed")
    time_limit: Seconds = Field(default=3600.0, description="s that one attempt at a job may take before it is stopped")
    executor: Literal["local", "dask"] = Field(
        default="local", description="where analyses run: processes of this machine, or a Dask cluster"
    )
    dask_address: str | None = Field(default=None, description='address of the Dask scheduler, for executor = "dask"')

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.executor == "dask" and self.dask_address is None:
            raise ValueError('jobs.executor = "dask" needs jobs.dask_address, such as tcp://scheduler:8786')
        return self


class Analysis(Group):
    """How events are analysed."""

    estimator: Literal["smoother", "cms"] = Field(
        default="smoother", description="estimator of the restoring force: smoother or cms"
    )
    rate: Annotated[float, Field(gt=0)] = Field(default=100.0, description="Hz, to which records are resampled")
    band: tuple[float, float] = Field(default=(0.1, 30.0), description="Hz, pass band of all estimates")

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if not 0 < self.band[0] < self.band[1] < self.rate / 2:
            raise ValueError(
                f"analysis.band must rise from above 0 Hz to below analysis.rate / 2 = {self.rate / 2} Hz, "
                f"got {self.band}"
            )
        return self


class DataHealth(Group):
    """When missing data raises an alert."""

    interval: Seconds = Field(default=60.0, description="s between two checks of data health")
    source_timeout: Seconds = Field(
        default=3600.0, description="s for which a source may fail, or one poll of it last, before an alert"
    )
    continuous_timeout: Seconds = Field(
        default=7200.0, description="s without a good record from a continuous source before an alert"
    )
    event_silence_timeout: Seconds = Field(
        default=31_536_000.0, description="s without a good record from a source of events before an alert"
    )
    channel_misses: Count = Field(
        default=3, description="earthquakes in a row without a good record of a channel before an alert"
    )
    rejected_age: Seconds = Field(
        default=604_800.0, description="s for which a file that could not be used keeps an alert active"
    )
    clock_tolerance: Seconds = Field(
        default=60.0, description="s by which the recorder's or the server's clock may be off before an alert"
    )
    worker_timeout: Seconds = Field(
        default=1800.0, description="s for which jobs may wait without an active worker before an alert"
    )
    disk_reserve: int = Field(
        default=2 * 2**30, ge=0, description="bytes to keep free for an SQLite database; less raises an alert"
    )


class Smtp(Group):
    """The outgoing mail server."""

    host: str | None = Field(default=None, description="outgoing mail server; without it no mail is sent")
    port: int = Field(default=587, ge=1, le=65535, description="port of the mail server")
    security: Literal["starttls", "tls", "none"] = Field(
        default="starttls", description="starttls, tls (from the first byte, often port 465) or none"
    )
    user: str | None = Field(default=None, description="user name at the mail server")
    password: SecretStr | None = Field(default=None, description="password at the mail server")
    sender: str = Field(default="menshin@localhost", description="address that mail comes from")

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if (self.user is None) != (self.password is None):
            raise ValueError("smtp.user and smtp.password go together; give both or neither")
        return self


class Notify(Group):
    """Messages and their delivery."""

    max_event_age: Seconds = Field(
        default=172_800.0, description="s after its end for which an earthquake is reported; later only if it alarms"
    )
    reminder_interval: float = Field(
        default=604_800.0, ge=0, description="s between reminders of an alert that is not acknowledged; 0: none"
    )
    allowed_private_hosts: tuple[str, ...] = Field(
        default=(),
        description="names of hosts, and networks such as 10.1.0.0/16, that messages may go to although they are not "
        "public",
    )
    allow_plain_http: bool = Field(
        default=False, description="whether messages may go to addresses that begin with http://"
    )
    timeout: Seconds = Field(default=30.0, description="s that an attempt to deliver a message may take")
    attempts: Count = Field(default=30, description="attempts to deliver a message to a recipient")
    retry_delay: Seconds = Field(
        default=10.0, description="s before the second attempt; each further one waits about twice as long"
    )
    longest_delay: Seconds = Field(default=3600.0, description="s between two attempts at most")
    alertmanager_interval: Seconds = Field(
        default=60.0, description="s between two repetitions of active alerts to an Alertmanager"
    )


class Heartbeat(Group):
    """The external watchdog of the service."""

    url: SecretStr | None = Field(
        default=None, description="external address that is requested while the service works; see messages.md"
    )
    interval: Seconds = Field(default=60.0, description="s between two heartbeats")


class Settings(BaseSettings):
    """All settings of the service."""

    model_config = SettingsConfigDict(env_prefix=PREFIX, env_nested_delimiter="__", extra="forbid", frozen=True)

    database_url: str = Field(
        default_factory=lambda: f"sqlite:///{user_data_path('menshin') / 'menshin.sqlite'}",
        description="SQLAlchemy address of the database: sqlite:///file or postgresql://user:password@host/name",
    )
    host: str = Field(default="127.0.0.1", description="address that the API listens on")
    port: int = Field(default=8000, ge=0, le=65535, description="port that the API listens on; 0 takes a free one")
    public_url: str | None = Field(
        default=None, description="address of the pages, such as https://menshin.example.org; messages link to it"
    )
    log_level: Literal["debug", "info", "warning", "error"] = Field(
        default="info", description="lowest level of the lines in the log"
    )
    trusted_proxies: tuple[str, ...] = Field(
        default=(),
        description="addresses of reverse proxies whose X-Forwarded-For and X-Forwarded-Proto are believed; see "
        "security.md",
    )
    max_connections: Annotated[int, Field(ge=8)] = Field(
        default=512, description="simultaneous connections to the API; fewer where the limit of open files is low"
    )
    max_dataselect_samples: Count = Field(
        default=30_000_000, description="samples of the largest answer of /fdsnws/dataselect"
    )
    progress_timeout: Seconds = Field(
        default=30.0, description="s without news after which a stream of a job's progress ends; browsers reconnect"
    )
    effects_folder: Path | None = Field(
        default=None, description="folder with effects of your own, one Python file each; see effects-own.md"
    )
    login: Login = Login()
    polling: Polling = Polling()
    parser: Parser = Parser()
    event: Event = Event()
    trigger: Trigger = Trigger()
    jobs: Jobs = Field(default_factory=Jobs)
    analysis: Analysis = Analysis()
    data_health: DataHealth = DataHealth()
    smtp: Smtp = Smtp()
    notify: Notify = Notify()
    heartbeat: Heartbeat = Heartbeat()

    @field_validator("database_url")
    @classmethod
    def _address(cls, address: str) -> str:
        if problem := wrong_address(address):
            raise ValueError(problem)
        return address

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
            ValueError: a menshin.toml in the working directory, which no one named, names a folder of code to run.
        """
        arguments = InitSettingsSource(settings_cls, grouped(getattr(init_settings, "init_kwargs", {})))
        file = settings_file()
        if file is None:
            return (arguments, Environment(settings_cls))
        written = File(settings_cls, file)
        if "effects_folder" in written() and not os.environ.get(FILE_VARIABLE):
            raise ValueError(
                f"{file} of the working directory sets effects_folder, whose files are run as code. If you trust the "
                f"file, name it in {FILE_VARIABLE}, or set {PREFIX}EFFECTS_FOLDER instead."
            )
        return (arguments, Environment(settings_cls), written)

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
    """Where the value comes from: an environment variable, a file, or the default."""
    description: str


class Environment(EnvSettingsSource):
    """The environment; an old name counts where the new one is absent."""

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


def grouped(given: Mapping[str, Any]) -> dict[str, Any]:
    """The same settings with each old name replaced by its new one; where both are given, the new one counts."""
    made = {name: value for name, value in given.items() if name not in OLD_NAMES}
    for old in OLD_NAMES.keys() & given.keys():
        group, _, name = OLD_NAMES[old].rpartition(".")
        if not group:
            made.setdefault(name, given[old])
        elif isinstance(members := made.get(group, {}), Mapping):
            made[group] = {name: given[old], **members}
    return made


def settings_file() -> Path | None:
    """The settings file: the one that MENSHIN_SETTINGS names, else menshin.toml in the working directory.

    Raises:
        FileNotFoundError: the file that MENSHIN_SETTINGS names does not exist.
    """
    if named := os.environ.get(FILE_VARIABLE):
        if not Path(named).is_file():
            raise FileNotFoundError(f"{FILE_VARIABLE} names {named}, which is no file; unset it or write that file")
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


def variable(name: str) -> str:
    """The environment variable of a setting."""
    return PREFIX + name.upper().replace(".", "__")


def unknown_variables(environment: Mapping[str, str]) -> tuple[str, ...]:
    """A line for each variable that begins with MENSHIN_ and is no setting; no line repeats a value."""
    known = {FILE_VARIABLE, KEY_VARIABLE, *map(variable, settings_by_name())}
    strange = {name for name in environment if name.startswith(PREFIX)} - known - set(map(variable, OLD_NAMES))
    lines = (f"the variable {name} is not a setting and is ignored{_nearest(name, known)}" for name in sorted(strange))
    return tuple(lines)


def old_names(environment: Mapping[str, str], file: Path | None) -> tuple[str, ...]:
    """A line with the new name for each old one in the environment and in the settings file."""
    written = {} if file is None else TomlConfigSettingsSource(Settings, file)()
    variables = (old for old in OLD_NAMES if variable(old) in environment)
    members = (old for old in OLD_NAMES if old in written)
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
        return make_url(str(value)).render_as_string(hide_password=True)
    return "" if value is None else str(value)
