"""The groups of settings: names, defaults, limits and descriptions."""

from pathlib import Path
from typing import Annotated, Literal, Self
from urllib.parse import urlsplit

from pydantic import BaseModel, ConfigDict, Field, SecretStr, field_validator, model_validator

from core.concurrency import processors
from service.addresses import is_loopback, web_address_problem

Seconds = Annotated[float, Field(gt=0)]
Count = Annotated[int, Field(ge=1)]


class Group(BaseModel):
    """Settings of one subject: a table of the TOML file."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Login(Group):
    """Browser sessions."""

    idle_timeout: Seconds = Field(
        default=43_200.0, description="seconds without a request after which a browser must log in again"
    )
    lifetime: Seconds = Field(
        default=604_800.0, description="seconds after which a browser must log in again in any case"
    )


class OidcGrant(Group):
    """A role of the people of a group."""

    group: str = Field(min_length=1, description="name of the group, as the provider's tokens have it")
    role: Literal["viewer", "engineer", "admin"]
    buildings: tuple[str, ...] | None = Field(default=None, description="codes of the buildings; without it all")


class Oidc(Group):
    """Sign-in of people through an OpenID Connect provider."""

    issuer: str | None = Field(
        default=None,
        description="address of the sign-in provider, exactly as in its tokens; none: no sign-in; see security.md",
    )
    client_id: str | None = Field(default=None, description="name of the service at the provider")
    client_secret: SecretStr | None = Field(
        default=None, description="secret of the service at the provider; none for a public client"
    )
    name: str = Field(default="single sign-on", description="name of the provider on the login page")
    scopes: tuple[str, ...] = Field(default=("openid", "profile"), description="scopes that are requested")
    name_claim: str = Field(
        default="preferred_username",
        description="claim with the name of the person for pages and the audit trail; if it is absent, the "
        "person's identifier at the provider (sub) is used",
    )
    groups_claim: str = Field(
        default="groups", description="claim with the groups of the person; dots separate the names of nested objects"
    )
    grants: tuple[OidcGrant, ...] = Field(
        default=(),
        description="roles of groups: a list with group, role and, to limit the role to some buildings, buildings",
    )
    timeout: Seconds = Field(
        default=10.0, description="seconds that the exchange with the provider may take during a sign-in"
    )
    session_lifetime: Seconds = Field(
        default=43_200.0, description="seconds after which a person must sign in again; groups are read at sign-in"
    )

    @field_validator("issuer")
    @classmethod
    def _address(cls, issuer: str | None) -> str | None:
        parts = urlsplit(issuer or "https://unset")
        if parts.query or parts.fragment or not parts.hostname or parts.username:
            raise ValueError("the issuer is an address without query, fragment and user name")
        if parts.scheme != "https" and not (parts.scheme == "http" and is_loopback(parts.hostname)):
            raise ValueError("the issuer's address must begin with https:// (http:// only on this machine itself)")
        return issuer

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if (self.issuer is None) != (self.client_id is None):
            raise ValueError("oidc.issuer and oidc.client_id go together; give both or neither")
        if "openid" not in self.scopes:
            raise ValueError('oidc.scopes must contain "openid"')
        if self.issuer is not None and not self.grants:
            raise ValueError("oidc.grants is empty: no person could sign in; give a group and its role")
        return self


class Polling(Group):
    """Requests to monitoring servers."""

    interval: Seconds = Field(default=60.0, description="seconds between two polls of a source")
    concurrency: Count = Field(default=4, description="simultaneous requests to one source")
    timeout: Seconds = Field(default=30.0, description="seconds without a byte after which a request is given up")
    retries: int = Field(default=3, ge=0, description="how often a failed request is repeated, at growing intervals")
    retry_delay: Seconds = Field(
        default=1.0, description="seconds before the first repetition; the wait doubles before each further one"
    )
    max_answer_bytes: Count = Field(
        default=256 * 2**20, description="bytes of the largest file or answer that is accepted"
    )
    late_data: float = Field(
        default=3600.0,
        ge=0,
        description="seconds during which data that a server (fdsnws) does not have yet is requested again",
    )
    settle_time: float = Field(
        default=2.0, ge=0, description="seconds that a file must have been left unchanged before it is read"
    )


class Parser(Group):
    """Limits of the process that reads one file."""

    time_limit: Seconds = Field(
        default=30.0,
        description="seconds of processor time, or twice as many by the clock, that reading one file may take",
    )
    memory_limit: Annotated[int, Field(ge=2**26)] = Field(
        default=2 * 2**30, description="bytes of memory that reading one file may take"
    )


class Event(Group):
    """Files that belong to one earthquake."""

    grace: float = Field(
        default=120.0, ge=0, description="seconds that an event waits for missing channels after its last file"
    )
    tolerance: float = Field(
        default=5.0, ge=0, description="largest gap in seconds between two files of one earthquake"
    )
    longest: Seconds = Field(
        default=10_800.0,
        description="longest earthquake in seconds: longer records of events are rejected, and longer "
        "windows of continuous records are cut",
    )


class Trigger(Group):
    """The STA/LTA trigger for continuous records."""

    short_window: Seconds = Field(default=1.0, description="short-term window of the STA/LTA trigger in seconds")
    long_window: Seconds = Field(default=30.0, description="long-term window of the STA/LTA trigger in seconds")
    on: Annotated[float, Field(gt=1)] = Field(default=4.0, description="STA/LTA ratio that begins an event")
    off: Annotated[float, Field(gt=0)] = Field(default=1.5, description="STA/LTA ratio that ends an event")
    channels: Count = Field(default=2, description="channels that must trigger together")
    floor: float = Field(default=0.005, ge=0, description="smallest peak acceleration of an event in m/s²")
    before: Seconds = Field(default=30.0, description="seconds kept before a trigger")
    after: Seconds = Field(default=60.0, description="seconds kept after a trigger")

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


class Stream(Group):
    """Live streams."""

    keep: Annotated[float, Field(ge=600)] = Field(
        default=86_400.0, description="seconds during which the packets of a live stream are kept"
    )
    after: Seconds = Field(
        default=20.0, description="seconds kept after the shaking in a live stream; for files, trigger.after applies"
    )
    announced: float = Field(
        default=0.08,
        ge=0,
        description="acceleration in m/s² from which an early message is sent while a live stream shows the "
        "shaking; the default is about JMA intensity 3",
    )
    silence: Annotated[float, Field(ge=1)] = Field(
        default=120.0,
        description="seconds without a packet after which a live stream counts as failing and is reconnected",
    )
    patience: Seconds = Field(
        default=15.0,
        description="seconds without data of a channel after which an earthquake is cut from a live stream "
        "without this channel; later data is added",
    )


class Jobs(Group):
    """Execution of jobs."""

    workers: Count | None = Field(
        default=None, description="simultaneous analyses; if it is not set, one for each processor"
    )
    lease: Seconds = Field(
        default=120.0, description="seconds after which a silent worker's job is given to another one"
    )
    attempts: Count = Field(default=3, description="attempts after which a job counts as failed")
    time_limit: Seconds = Field(
        default=3600.0, description="seconds that one attempt at a job may take before it is stopped"
    )
    executor: Literal["local", "dask"] = Field(
        default="local", description="where analyses run: processes of this machine, or a Dask cluster"
    )
    dask_address: str | None = Field(default=None, description='address of the Dask scheduler, for executor = "dask"')
    dask_tls_ca: Path | None = Field(
        default=None, description="file with the certificate authority of a Dask cluster with TLS (tls://...)"
    )
    dask_tls_certificate: Path | None = Field(
        default=None, description="file with the certificate by which the scheduler recognises this process"
    )
    dask_tls_key: Path | None = Field(default=None, description="file with the key of that certificate")

    kept_room: Annotated[float, Field(ge=0)] = Field(
        default=1.0,
        description="GB of analyses kept on disk for later commands and jobs, in the user's cache folder; 0: none",
    )
    warm: bool = Field(
        default=True, description="whether idle processes load in advance what work on models needs, about 320 MB each"
    )

    @property
    def processes(self) -> int:
        """Simultaneous analyses."""
        return self.workers or processors()

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.executor == "dask" and self.dask_address is None:
            raise ValueError('jobs.executor = "dask" needs jobs.dask_address, such as tcp://scheduler:8786')
        files = (self.dask_tls_ca, self.dask_tls_certificate, self.dask_tls_key)
        if any(files) and not all(files):
            raise ValueError("jobs.dask_tls_ca, jobs.dask_tls_certificate and jobs.dask_tls_key go together")
        if any(files) and not (self.dask_address or "").startswith("tls://"):
            raise ValueError("jobs.dask_tls_ca needs a jobs.dask_address that begins with tls://")
        return self


class Analysis(Group):
    """Analysis of events."""

    estimator: Literal["smoother", "cms"] = Field(
        default="smoother", description="estimator of the restoring force: smoother or cms"
    )
    rate: Annotated[float, Field(gt=0)] = Field(
        default=100.0, description="sampling rate in Hz to which records are resampled"
    )
    band: tuple[float, float] = Field(default=(0.1, 30.0), description="pass band of all estimates in Hz")
    integral: Literal["recorded", "restored"] = Field(
        default="recorded",
        description="motion used from a displacement channel that was integrated from accelerations: "
        "recorded, or restored, which includes the slow motion that its high-pass filter removed",
    )

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if not 0 < self.band[0] < self.band[1] < self.rate / 2:
            raise ValueError(
                f"analysis.band must rise from above 0 Hz to below analysis.rate / 2 = {self.rate / 2} Hz, "
                f"got {self.band}"
            )
        return self


class DataHealth(Group):
    """Conditions under which missing data raises an alert."""

    interval: Seconds = Field(default=60.0, description="seconds between two checks of data health")
    source_timeout: Seconds = Field(
        default=3600.0, description="seconds that a source may fail, or that one poll of it may last, before an alert"
    )
    continuous_timeout: Seconds = Field(
        default=7200.0, description="seconds without a good record from a continuous source before an alert"
    )
    event_silence_timeout: Seconds = Field(
        default=31_536_000.0, description="seconds without a good record from a source of events before an alert"
    )
    channel_misses: Count = Field(
        default=3, description="consecutive earthquakes without a good record of a channel before an alert"
    )
    rejected_age: Seconds = Field(
        default=604_800.0, description="seconds during which a file that could not be used keeps an alert active"
    )
    clock_tolerance: Seconds = Field(
        default=60.0, description="seconds by which the recorder's or the server's clock may be off before an alert"
    )
    worker_timeout: Seconds = Field(
        default=1800.0, description="seconds that jobs may wait without an active worker before an alert"
    )
    disk_reserve: int = Field(
        default=2 * 2**30, ge=0, description="bytes that must be free for an SQLite database; fewer raise an alert"
    )


class Retention(Group):
    """Data that `menshin prune` may delete; by default none."""

    superseded_histories: Annotated[float, Field(ge=0)] | None = Field(
        default=None,
        description="seconds after which 'menshin prune' deletes the histories of an analysis that a later "
        "one superseded; none: they are kept",
    )
    superseded_analyses: Annotated[float, Field(ge=86_400)] | None = Field(
        default=None,
        description="seconds after which 'menshin prune' deletes an analysis that a later one superseded, "
        "with all its numbers; none: they are kept",
    )
    original_files: Annotated[float, Field(ge=86_400)] | None = Field(
        default=None,
        description="seconds after which 'menshin prune' deletes original files that were read, counted from their "
        "arrival; none: they are kept",
    )
    jobs: Annotated[float, Field(ge=86_400)] | None = Field(
        default=None,
        description="seconds after which 'menshin prune' deletes jobs, counted from their end, with the results that "
        "only they have; none: they are kept",
    )
    messages: Annotated[float, Field(ge=604_800)] | None = Field(
        default=None,
        description="seconds after which 'menshin prune' deletes a message that was followed by a later one, "
        "with its deliveries; none: they are kept",
    )
    audit_trail: Annotated[float, Field(ge=604_800)] | None = Field(
        default=None,
        description="seconds after which 'menshin prune' deletes entries of the audit trail; none: they are kept",
    )


class Storage(Group):
    """Original files outside the database."""

    originals: str | None = Field(
        default=None,
        description="where new original files are kept: file:///folder, or s3://bucket/prefix of an S3-compatible "
        "store; none: in the database; see storage.md",
    )
    s3_endpoint: str | None = Field(
        default=None,
        description="address of the S3-compatible store, such as https://s3.example.org; none: that of Amazon",
    )
    s3_access_key: SecretStr | None = Field(
        default=None, description="access key of the store; none: the one in the variables and files of AWS"
    )
    s3_secret_key: SecretStr | None = Field(default=None, description="secret key that belongs to this access key")
    timeout: Seconds = Field(
        default=30.0, description="seconds without a byte after which a request to the store is given up"
    )

    @field_validator("originals")
    @classmethod
    def _place(cls, originals: str | None) -> str | None:
        if originals is None:
            return None
        parts = urlsplit(originals)
        if parts.scheme not in ("file", "s3"):
            raise ValueError("original files are kept at file:///folder or s3://bucket/prefix")
        if parts.query or parts.fragment or "@" in parts.netloc:
            raise ValueError("the address has no user name, password, query or fragment; keys have their own settings")
        if parts.scheme == "file" and (parts.netloc or len(parts.path) < len("/x")):
            raise ValueError("a folder is named from the root, after three slashes: file:///srv/menshin/originals")
        if parts.scheme == "s3" and not parts.netloc:
            raise ValueError("the address lacks the bucket: s3://bucket/prefix")
        return originals.rstrip("/")

    @field_validator("s3_endpoint")
    @classmethod
    def _address(cls, endpoint: str | None) -> str | None:
        if endpoint is not None and (problem := web_address_problem(endpoint)):
            raise ValueError(problem)
        return endpoint

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if (self.s3_access_key is None) != (self.s3_secret_key is None):
            raise ValueError("storage.s3_access_key and storage.s3_secret_key go together; give both or neither")
        return self


class Smtp(Group):
    """The outgoing mail server."""

    host: str | None = Field(default=None, description="outgoing mail server; none: no mail is sent")
    port: int = Field(default=587, ge=1, le=65535, description="port of the mail server")
    security: Literal["starttls", "tls", "none"] = Field(
        default="starttls", description="starttls, tls (from the first byte, often port 465) or none"
    )
    user: str | None = Field(default=None, description="user name at the mail server")
    password: SecretStr | None = Field(default=None, description="password at the mail server")
    sender: str = Field(default="menshin@localhost", description="sender's address of the mail")

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if (self.user is None) != (self.password is None):
            raise ValueError("smtp.user and smtp.password go together; give both or neither")
        return self


class Notify(Group):
    """Messages and their delivery."""

    max_event_age: Seconds = Field(
        default=172_800.0,
        description="seconds after its end during which an earthquake is reported; after that only if it "
        "raises an alarm",
    )
    reminder_interval: float = Field(
        default=604_800.0, ge=0, description="seconds between reminders of an alert that is not acknowledged; 0: none"
    )
    allowed_private_hosts: tuple[str, ...] = Field(
        default=(),
        description="names of hosts, and networks such as 10.1.0.0/16, to which messages may be sent "
        "although they are not public",
    )
    allow_plain_http: bool = Field(
        default=False, description="whether messages may be sent to addresses that begin with http://"
    )
    timeout: Seconds = Field(default=30.0, description="seconds that one attempt to deliver a message may take")
    attempts: Count = Field(default=30, description="largest number of attempts to deliver a message to a recipient")
    retry_delay: Seconds = Field(
        default=10.0, description="seconds before the second attempt; the wait about doubles before each further one"
    )
    longest_delay: Seconds = Field(default=3600.0, description="longest wait in seconds between two attempts")
    alertmanager_interval: Seconds = Field(
        default=60.0, description="seconds between two repetitions of active alerts to an Alertmanager"
    )


class Heartbeat(Group):
    """The external watchdog of the service."""

    url: SecretStr | None = Field(
        default=None,
        description="external address that is requested regularly while the service works; see messages.md",
    )
    interval: Seconds = Field(default=60.0, description="seconds between two heartbeats")


class Traces(Group):
    """Traces by OpenTelemetry."""

    endpoint: str | None = Field(
        default=None,
        description="address of an OTLP receiver (HTTP), such as http://127.0.0.1:4318; none: no traces; "
        "needs the extra traces; see running.md",
    )
    share: Annotated[float, Field(ge=0, le=1)] = Field(default=1.0, description="share of all traces that is sent")

    @field_validator("endpoint")
    @classmethod
    def _address(cls, endpoint: str | None) -> str | None:
        if endpoint is not None and (problem := web_address_problem(endpoint)):
            raise ValueError(problem)
        return endpoint
