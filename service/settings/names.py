"""Names of settings: environment variables, and the names of development versions, which are still read."""

from collections.abc import Mapping
from typing import Any

PREFIX = "MENSHIN_"
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
"""Names of development versions and the settings that replace them."""


def variable(name: str) -> str:
    """The environment variable of a setting."""
    return PREFIX + name.upper().replace(".", "__")


def grouped(given: Mapping[str, Any]) -> dict[str, Any]:
    """Settings with old names replaced by new ones; the new name wins where both are given."""
    new = {name: value for name, value in given.items() if name not in OLD_NAMES}
    for old in OLD_NAMES.keys() & given.keys():
        group, _, name = OLD_NAMES[old].rpartition(".")
        if not group:
            new.setdefault(name, given[old])
        elif isinstance(members := new.get(group, {}), Mapping):
            new[group] = {name: given[old], **members}
    return new
