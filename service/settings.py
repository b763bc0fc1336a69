"""What can be set: by environment variables (MENSHIN_...) over a TOML file over the defaults."""

import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Literal, Self

from platformdirs import user_data_path
from pydantic import Field, SecretStr, field_validator, model_validator
from pydantic_settings import (
    BaseSettings,
    EnvSettingsSource,
    PydanticBaseSettingsSource,
    SettingsConfigDict,
    TomlConfigSettingsSource,
)
from sqlalchemy.engine import make_url

from service.db.problems import wrong_address

PREFIX = "MENSHIN_"
FILE_VARIABLE = "MENSHIN_SETTINGS"
KEY_VARIABLE = "MENSHIN_SECRET_KEY"
"""Of service.db.encryption; no setting, so that it is never shown."""
DEFAULT_FILE = "menshin.toml"

Seconds = Annotated[float, Field(gt=0)]
Count = Annotated[int, Field(ge=1)]


@dataclass(frozen=True, slots=True)
class Explained:
    """One setting as it is in force."""

    name: str
    value: str
    """Fit to be shown: passwords are masked."""
    origin: str
    """Where the value came from: a variable of the environment, a file, or the default."""
    description: str


def settings_file() -> Path | None:
    """The TOML file that applies: the one that MENSHIN_SETTINGS names, else menshin.toml in the working directory.

    Raises:
        FileNotFoundError: MENSHIN_SETTINGS names a file that is not there.
    """
    if named := os.environ.get(FILE_VARIABLE):
        if not Path(named).is_file():
            raise FileNotFoundError(f"{FILE_VARIABLE} names {named}, which is no file; unset it or write that file")
        return Path(named)
    return Path(DEFAULT_FILE) if Path(DEFAULT_FILE).is_file() else None


def default_database_url() -> str:
    """An SQLite file in the user's data folder."""
    return f"sqlite:///{user_data_path('menshin') / 'menshin.sqlite'}"


class Settings(BaseSettings):
    """Everything that can be set."""

    model_config = SettingsConfigDict(env_prefix=PREFIX, extra="forbid", frozen=True)

    database_url: str = Field(
        default_factory=default_database_url,
        description="SQLAlchemy address of the database: sqlite:///file or postgresql://user:password@host/name",
    )
    host: str = Field(default="127.0.0.1", description="address that the API listens on")
    port: int = Field(default=8000, ge=0, le=65535, description="port that the API listens on; 0 takes a free one")
    log_level: Literal["debug", "info", "warning", "error"] = Field(
        default="info", description="least grave lines that are written to the log"
    )
    max_dataselect_samples: Count = Field(
        default=30_000_000, description="samples of the largest answer of /fdsnws/dataselect"
    )
    max_connections: Annotated[int, Field(ge=8)] = Field(
        default=512, description="connections that the API holds at once; fewer where the limit of open files is low"
    )
    trusted_proxies: tuple[str, ...] = Field(
        default=(),
        description="addresses of reverse proxies whose X-Forwarded-For and X-Forwarded-Proto are believed; see "
        "security.md",
    )
    login_idle: Seconds = Field(default=43_200.0, description="s without a request after which a browser logs in again")
    login_lifetime: Seconds = Field(default=604_800.0, description="s after which a browser logs in again in any case")
    progress_patience: Seconds = Field(
        default=30.0, description="s without news after which a stream of a job's progress ends; browsers ask again"
    )

    poll_interval: Seconds = Field(default=60.0, description="s between two looks at every source")
    source_concurrency: Count = Field(default=4, description="requests that run at the same time at one source")
    http_timeout: Seconds = Field(default=30.0, description="s without a byte after which a request is given up")
    http_retries: int = Field(default=3, ge=0, description="times that a failed request is repeated, ever later")
    retry_delay: Seconds = Field(
        default=1.0, description="s before the first repetition; the next ones wait twice as long"
    )
    max_answer_bytes: Count = Field(
        default=256 * 2**20, description="bytes of the largest file or answer that is accepted"
    )
    late_data: float = Field(
        default=3600.0, ge=0, description="s for which what a server (fdsnws) does not have yet is asked for again"
    )
    settle_time: float = Field(
        default=2.0, ge=0, description="s that a file must have been left unchanged before it is read"
    )

    parser_time: Seconds = Field(
        default=30.0, description="s of processor time, or twice as many on the clock, that reading one file may take"
    )
    parser_memory: Annotated[int, Field(ge=2**26)] = Field(
        default=2 * 2**30, description="bytes of memory that reading one file may take"
    )

    event_grace: float = Field(
        default=120.0, ge=0, description="s after its last file that an event waits for missing channels"
    )
    event_tolerance: float = Field(
        default=5.0, ge=0, description="s between two files that may still belong to one earthquake"
    )
    longest_event: Seconds = Field(
        default=10_800.0,
        description="s, longest earthquake: longer records of events are rejected, and longer windows of continuous "
        "ones are cut",
    )
    trigger_short: Seconds = Field(default=1.0, description="s, short-term window of the STA/LTA trigger")
    trigger_long: Seconds = Field(default=30.0, description="s, long-term window of the STA/LTA trigger")
    trigger_on: Annotated[float, Field(gt=1)] = Field(default=4.0, description="STA/LTA ratio that begins an event")
    trigger_off: Annotated[float, Field(gt=0)] = Field(default=1.5, description="STA/LTA ratio that ends an event")
    trigger_channels: Count = Field(default=2, description="channels that must trigger together")
    trigger_floor: float = Field(
        default=0.005, ge=0, description="m/s², largest acceleration below which nothing is an event"
    )
    trigger_before: Seconds = Field(default=30.0, description="s kept before a trigger")
    trigger_after: Seconds = Field(default=60.0, description="s kept after a trigger")

    workers: Count = Field(
        default_factory=lambda: os.cpu_count() or 1, description="analyses that run at the same time"
    )
    lease: Seconds = Field(default=120.0, description="s after which a silent worker's job is given to another one")
    job_attempts: Count = Field(default=3, description="times that a job is tried before it counts as failed")
    job_time_limit: Seconds = Field(
        default=3600.0, description="s that one attempt at a job may take before it is stopped"
    )
    executor: Literal["local", "dask"] = Field(
        default="local", description="where analyses run: processes of this machine, or a Dask cluster"
    )
    dask_address: str | None = Field(default=None, description="address of the Dask scheduler, for executor = dask")

    message_age: Seconds = Field(
        default=172_800.0, description="s after its end for which an earthquake is told of; an older one if it alarms"
    )
    reminder_interval: float = Field(
        default=604_800.0,
        ge=0,
        description="s after which those who were told of an alert that nobody has taken on are reminded; 0: never",
    )
    check_interval: Seconds = Field(default=60.0, description="s between two looks whether data stopped anywhere")
    source_patience: Seconds = Field(
        default=3600.0, description="s for which a source may fail, or a look at it last, before people are told"
    )
    continuous_patience: Seconds = Field(
        default=7200.0, description="s without a good record from a continuous source before people are told"
    )
    quiet_patience: Seconds = Field(
        default=31_536_000.0, description="s without a good record from a source of events before people are told"
    )
    channel_misses: Count = Field(
        default=3, description="earthquakes in a row without a good record of a channel before people are told"
    )
    rejected_age: Seconds = Field(
        default=604_800.0, description="s for which a file that could not be used keeps an alert active"
    )
    clock_tolerance: Seconds = Field(
        default=60.0, description="s by which the recorder's or the server's clock may be off before people are told"
    )
    worker_patience: Seconds = Field(
        default=1800.0, description="s for which work may wait while no worker does any before people are told"
    )
    disk_reserve: int = Field(
        default=2 * 2**30, ge=0, description="bytes that ought to be free for an SQLite database, else people are told"
    )

    effects_folder: Path | None = Field(
        default=None, description="folder with effects of your own, one Python file each; see effects-own.md"
    )
    estimator: Literal["smoother", "cms"] = Field(
        default="smoother", description="estimator of the restoring force: smoother or cms"
    )
    rate: Annotated[float, Field(gt=0)] = Field(default=100.0, description="Hz, to which records are resampled")
    band: tuple[float, float] = Field(default=(0.1, 30.0), description="Hz, pass band of everything that is estimated")

    public_url: str | None = Field(
        default=None,
        description="address at which people reach the pages, such as https://menshin.example.org; messages link to it",
    )
    smtp_host: str | None = Field(default=None, description="mail server that takes our mail; without it none is sent")
    smtp_port: int = Field(default=587, ge=1, le=65535, description="port of the mail server")
    smtp_security: Literal["starttls", "tls", "none"] = Field(
        default="starttls", description="starttls, tls (from the first byte, often port 465) or none"
    )
    smtp_user: str | None = Field(default=None, description="name to log in with at the mail server")
    smtp_password: SecretStr | None = Field(default=None, description="password to log in with at the mail server")
    mail_from: str = Field(default="menshin@localhost", description="address that mail comes from")
    inside_allowed: tuple[str, ...] = Field(
        default=(),
        description="names of hosts, and networks such as 10.1.0.0/16, that messages may go to although they are not "
        "public",
    )
    plain_http_allowed: bool = Field(
        default=False, description="whether messages may go to addresses that begin with http://"
    )
    notice_timeout: Seconds = Field(default=30.0, description="s that an attempt to deliver a message may take")
    notice_attempts: Count = Field(default=30, description="times that a message is tried at a receiver")
    notice_delay: Seconds = Field(
        default=10.0, description="s before the second attempt; the next ones wait twice as long, less by chance"
    )
    notice_longest_delay: Seconds = Field(default=3600.0, description="s between two attempts at most")
    alertmanager_interval: Seconds = Field(
        default=60.0, description="s after which an Alertmanager is told again of what still stands"
    )
    heartbeat_url: SecretStr | None = Field(
        default=None, description="address outside that is asked as long as the service really works; see messages.md"
    )
    heartbeat_interval: Seconds = Field(default=60.0, description="s between two heartbeats")

    @field_validator("database_url")
    @classmethod
    def _address(cls, address: str) -> str:
        if problem := wrong_address(address):
            raise ValueError(problem)
        return address

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if not 0 < self.band[0] < self.band[1] < self.rate / 2:
            raise ValueError(f"band must rise from above 0 Hz to below rate / 2 = {self.rate / 2} Hz, got {self.band}")
        if self.trigger_off >= self.trigger_on:
            raise ValueError(f"trigger_off must be below trigger_on, got {self.trigger_off} and {self.trigger_on}")
        if self.trigger_short >= self.trigger_long:
            raise ValueError(
                f"trigger_short must be below trigger_long, got {self.trigger_short} and {self.trigger_long} s"
            )
        if (self.smtp_user is None) != (self.smtp_password is None):
            raise ValueError("smtp_user and smtp_password go together; give both or neither")
        if self.executor == "dask" and self.dask_address is None:
            raise ValueError("executor = dask needs dask_address, such as tcp://scheduler:8786")
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
            ValueError: a menshin.toml that nobody named, but that lies in the working directory, names a folder whose
                code would be run.
        """
        file = settings_file()
        if file is None:
            return (init_settings, env_settings)
        written = TomlConfigSettingsSource(settings_cls, file)
        if "effects_folder" in written() and not os.environ.get(FILE_VARIABLE):
            raise ValueError(
                f"{file} of the working directory sets effects_folder, whose files are run as code. If you trust the "
                f"file, name it in {FILE_VARIABLE}, or set {PREFIX}EFFECTS_FOLDER instead."
            )
        return (init_settings, env_settings, written)

    def explained(self) -> tuple[Explained, ...]:
        """Every setting, its value, and why it has it."""
        return tuple(
            Explained(name, _shown(name, getattr(self, name)), self._origin(name), field.description or "")
            for name, field in type(self).model_fields.items()
        )

    def _origin(self, name: str) -> str:
        file = settings_file()
        if name not in self.model_fields_set:
            return "default"
        if name in EnvSettingsSource(type(self))():
            return f"environment {PREFIX}{name.upper()}"
        if file is not None and name in TomlConfigSettingsSource(type(self), file)():
            return f"file {file}"
        return "argument"


def unknown_variables(environment: Mapping[str, str]) -> tuple[str, ...]:
    """A line for every variable that begins as ours do and is none; values are not repeated."""
    known = {FILE_VARIABLE, KEY_VARIABLE, *(f"{PREFIX}{name.upper()}" for name in Settings.model_fields)}
    strange = sorted(name for name in environment if name.startswith(PREFIX) and name not in known)
    return tuple(f"the variable {name} is not a setting and is ignored{_nearest(name, known)}" for name in strange)


def _nearest(name: str, known: Collection[str]) -> str:
    names = [one.removeprefix(PREFIX) for one in known]
    near = get_close_matches(name.removeprefix(PREFIX), names, n=1)
    return f"; did you mean {PREFIX}{near[0]}?" if near else "; `menshin settings` lists those that there are"


SECRETS = frozenset({"database_url", "smtp_password", "heartbeat_url"})
"""Settings of which no message repeats the value."""


def _shown(name: str, value: object) -> str:
    if name == "database_url":
        return make_url(str(value)).render_as_string(hide_password=True)
    return "" if value is None else str(value)
