"""The texts of this room that people read: names, dates and amounts, and the sentences of alerts
about single earthquakes, data health and reminders.

The sentences of a drift alert are in `service.drift.texts`, those of the verdict in `service.verdict.texts`, and the
frame of every message (marks, notes to new recipients) in `service.notify.texts`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from core.drift.quantities import BOTH_DIRECTIONS, QUANTITIES, SENSOR_QUANTITIES

MM = 1e3

# --- causes, states ---------------------------------------------------------------------------------------------------

LIMITS = "limits"
"""Cause of the alert that a limit of the isolators was exceeded."""
TITLES: Mapping[str, str] = {
    LIMITS: "limits of the building",
    "stiffness": "stiffness of the isolators",
    "damping": "damping of the isolators",
    "frequency": "natural frequency of the building",
    "residual_displacement": "rest position of the isolators",
    "gain": "sensitivity of sensor {sensor}",
    "noise": "noise of sensor {sensor}",
    "model_error": "model of the isolators",
    "source": "monitoring server",
    "record": "records",
    "rejected": "files that could not be used",
    "channel": "sensor {sensor}",
    "clock": "clock",
    "worker": "waiting analyses",
    "disk": "disk space",
}
"""By the first part of a cause; {sensor} is the channel of that sensor."""
RECOVERED = "recovery"
"""First part of a cause that is about the return of the one that follows."""
STATE_MEANINGS: Mapping[str, str] = {
    "pending": "evidence is building up; no message is sent yet",
    "on_hold": "another alert may explain it; it becomes active if the evidence remains once that one has ended",
    "active": "there is enough evidence, and messages are sent",
    "acknowledged": "a person is looking after it",
    "resolved": "settled by an inspection, or no longer the case",
    "withdrawn": "the alert was wrong, as better data or a review showed",
}


def quantity_of(cause: str) -> str | None:
    """The monitored quantity that a cause is about; None for a periodic check."""
    first, _, rest = cause.partition("/")
    if first == RECOVERED:
        return quantity_of(rest)
    return first if first in QUANTITIES else None


def sensor_of(cause: str) -> str | None:
    """Channel of the sensor that a cause is about; None if it is about the building or a periodic check."""
    first, _, rest = cause.partition("/")
    if first == RECOVERED:
        return sensor_of(rest)
    return rest if first in SENSOR_QUANTITIES else None


def cause(text: str) -> str:
    """`stiffness of the isolators, direction x`; a cause without a title is returned as it is."""
    first, _, rest = text.partition("/")
    if first == RECOVERED:
        return f"return of the {cause(rest)}"
    title = TITLES.get(first)
    if title is None:
        return text
    if not rest:
        return title
    return title.format(sensor=rest) if "{" in title else f"{title}, {subject(rest)}"


def subject(text: str) -> str:
    """`direction x`, `both directions on average`, `direction x, mode 1`."""
    direction, _, mode = text.partition("/")
    where = "both directions on average" if direction == BOTH_DIRECTIONS else f"direction {direction}"
    return where + (f", mode {mode}" if mode else "")


# --- times, lengths, lists --------------------------------------------------------------------------------------------


def local_time(local: datetime) -> str:
    """`5 January 2024, 14:03 (JST)`, for a time in the building's zone."""
    zone = f"{local:%Z}"
    named = f"UTC{zone}" if zone[:1] in "+-" else zone
    return f"{local.day} {local:%B %Y, %H:%M} ({named})"


def time_span(first: datetime, last: datetime) -> str:
    """`5 January 2024, 14:03 and 7 March 2024, 09:10 (JST)`, for two times in the building's zone."""
    start, end = local_time(first), local_time(last)
    zone = f" {start.rpartition(' ')[2]}"
    return f"{start.removesuffix(zone) if end.endswith(zone) else start} and {end}"


def length(metres: float) -> str:
    """In mm: `24 mm`, `2.4 mm`."""
    millimetres = metres * MM
    return f"{millimetres:.0f} mm" if abs(millimetres) >= 9.95 else f"{millimetres:.1f} mm"


def duration(span: timedelta) -> str:
    """In the largest unit that gives at least two: `3 days`, `90 minutes`, `40 seconds`."""
    seconds = span.total_seconds()
    text, size = next(one for one in DURATIONS if seconds >= 2 * one[1] or one[1] == 1)
    return text.format(count=seconds / size)


DURATIONS = (
    ("{count:.0f} days", 86400),
    ("{count:.0f} hours", 3600),
    ("{count:.0f} minutes", 60),
    ("{count:.0f} seconds", 1),
)
"""With the size of the unit in s, the largest first."""


def listed(names: Sequence[str]) -> str:
    """`a`, `a and b`, `a, b and c`."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def and_more(count: int) -> str:
    """` (and 2 more)` beside the first of three; empty for one."""
    return "" if count == 1 else f" (and {count - 1} more)"


# --- changes of an alert's state --------------------------------------------------------------------------------------

INSPECTION_IN_THE_FUTURE = (
    "The time of the inspection, {at:%Y-%m-%d %H:%M} UTC, is in the future; give the time at which it was made."
)
NO_SUCH_TIME = "{typed!r} is not a date and time, such as 2024-05-01T14:30"
BESIDES_EARLIER_CHANGE = "{summary}, besides an earlier change in {subject}"
NO_LONGER = "It is no longer the case."
EVIDENCE_GONE = "Later results no longer support it."
DATA_REVISED = "Data of its events were revised or arrived late, and no longer show it."
COVERED_BY_INSPECTION = "The inspection by {by} on {at:%Y-%m-%d} covers it."
ON_HOLD_FOR_SOURCE = "On hold: {summary}, which explains it."
ON_HOLD_FOR_SENSOR = "On hold: {summary}, which may be the only reason for this change."
NOT_ACTIVE = "Alert {id} is {state}: {meaning}; only an active alert can be acknowledged."
HAS_ENDED = "Alert {id} has been {state} since {closed_at:%Y-%m-%d %H:%M} UTC."
UNKNOWN_REFERENCE = "choose one of these reference periods"
HOURS_OF_SILENCE = "give a whole number of hours from 1 to {most}"
SILENCE_IN_THE_PAST = "The muting would end at {until:%Y-%m-%d %H:%M} UTC, which is in the past; give a later time."
REFERENCE_REASON = "Inspection of alert {id}: {note}"

REFERENCE_STAYS = "The reference period stays. The same change raises no new alert unless it gets worse."
REFERENCE_FROM_NOW = (
    "A new reference period begins with the next earthquake. The {title} then needs at least {needed} more "
    "earthquakes before it can raise an alarm again. {shared}"
)
REFERENCE_SINCE_IT_BEGAN = (
    "A new reference period begins with the earthquake of {when}. {counted}; the {title} needs at least {needed} more "
    "before it can raise an alarm again. {shared}"
)
ONE_COUNTS = "1 earthquake counts already"
SEVERAL_COUNT = "{count} earthquakes count already"
ALL_DIRECTIONS_SHARE = "All directions share it."
OTHER_SENSORS_KEEP = "Other sensors keep their reference periods."

# --- messages about an earthquake -------------------------------------------------------------------------------------

EVENT_SUBJECT = "Earthquake of {when}: {outcome}"
EARLY_SUBJECT = "Shaking since {when}: up to {peak} gal so far (provisional)"
EARLY = (
    "An earthquake has been shaking {name} since {when}. The largest acceleration so far is {peak} gal, "
    "on level {level}."
)
EARLY_PROVISIONAL = (
    "This is provisional: the shaking is not over, and nothing has been analysed. A message with the result follows."
)
FACT_EARLY = "Largest acceleration so far, level {level}"
UNUSABLE = "its records cannot be used"
MOVED = "isolators moved {length}, {outcome}"
MOVED_AT_LEAST = "isolators moved at least {length}, {outcome}"
ON_HOLD_OR_MUTED = "{count} alert{s} on hold or muted"
MOVED_ON_HOLD_OR_MUTED = "isolators moved {length}, {count} alert{s} on hold or muted"
MOVED_AT_LEAST_ON_HOLD_OR_MUTED = "isolators moved at least {length}, {count} alert{s} on hold or muted"
REPORTED_ELSEWHERE = "its alert is now reported with another earthquake"
ALERTS_ENDED = "its alerts have ended"

RECORDED_UNUSABLE = "An earthquake was recorded at {name} on {when}, but its records cannot be used: {reason}."
INSPECT_IF_STRONG = "The isolators cannot be assessed: have them inspected if the shaking was strong."
RECORDED_NO_DISPLACEMENT = (
    "An earthquake was recorded at {name} on {when}. How far the isolators moved was not measured."
)
RECORDED = "An earthquake was recorded at {name} on {when}. The isolators moved by {length} at most."
RECORDED_AT_LEAST = (
    "An earthquake was recorded at {name} on {when}. The isolators moved by at least {length}, in direction "
    "{direction}; how far they moved in plan is not known."
)
ALERT_ON_HOLD = (
    "Possible change: {summary}. However, a sensor used for this result is faulty, which may fully explain it. "
    "Another message follows when this is resolved."
)
ALERT_MUTED = "One alert ({cause}) is muted until {until}: {reason}."
ALERT_MOVED = "Later results link this to another earthquake, with which it is now reported: {summary}."
ALERT_WITHDRAWN = "Cancelled, because the alert was wrong: {summary}. {end}"
ALERT_RESOLVED = "Resolved: {summary}. {end}"
ALSO_OPEN = "Also open at the building: {causes}."

FACT_EVENT = "Earthquake"
FACT_PGA = "Largest ground acceleration"
FACT_DISPLACEMENT = "Largest isolator displacement, direction {direction}"
FACT_RESULTANT = "Largest isolator displacement in plan"
FACT_RESIDUAL = "Residual displacement, direction {direction}"
FACT_FORCE = "Largest restoring force, direction {direction}"
FACT_CHECK = "Check: {title}"
OUTCOME_OF_LIMIT = "{outcome}: limit {limit}"
FACT_ALERT = "Alert {id}"
FACT_SINCE = "Since"
FACT_ABOUT = "About"

# --- messages about an alert of the periodic checks, reminders --------------------------------------------------------

ALERT_SINCE = "{summary}, since {since}."
ALERT_ENDED = "This has ended: {summary}, since {since}. {end}"
ENDED_SUBJECT = "Ended: {summary}"

REMINDER_SUBJECT = "Not acknowledged yet: {summary}"
REMINDER_OPENING = "This is a reminder. The following was reported about {name}, is still open and is not acknowledged."
REMINDER_ALERT = "{summary}. It has been active since {since}."
REMINDER_HOW = (
    "To acknowledge an alert, open its page and note what you are doing about it; or end it there by recording an "
    "inspection. If you do not have the rights to do so, ask someone with the role engineer."
)
REMINDER_AGAIN = "Until then you are reminded every {interval}, unless the alert is muted."

# --- data health ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Wording:
    """Summary and sentences of a data health alert, with {placeholders}."""

    summary: str
    sentences: tuple[str, ...]

    def filled(self, **values: object) -> "Wording":
        """The same with its placeholders replaced."""
        return Wording(self.summary.format(**values), tuple(one.format(**values) for one in self.sentences))


SERVER_NEVER_ANSWERED = Wording(
    "The monitoring server has never answered at its address",
    ("Earthquakes are not monitored until it answers.", "Error: {error}."),
)
SERVER_SILENT_SINCE_CHANGE = Wording(
    "The monitoring server has not answered since the building file was changed",
    ("Check the address of its source. Earthquakes are not monitored until it answers.", "Error: {error}."),
)
SERVER_SILENT = Wording(
    "The monitoring server has not answered for more than {duration}",
    ("Earthquakes since then are missing until it answers again.", "{detail}"),
)
SERVER_ERROR = "Error: {error}."
REQUEST_NEVER_ENDS = "A request to it does not end."
NO_USABLE_RECORD = Wording(
    "No usable record has arrived for more than {duration}",
    ("The recorder may have stopped although its server answers: have it checked.",),
)
FILES_REJECTED = Wording(
    "{count}",
    (
        "Their contents are missing from the results. The page of the building's records lists every file with its "
        "reason.",
        "The first is {name}: {reason}.",
    ),
)
ONE_FILE = "A file could not be used"
SEVERAL_FILES = "{least} files or more could not be used"
AHEAD, BEHIND = "ahead", "behind"
RECORDER_CLOCK = Wording(
    "The recorder's clock is ahead by more than {tolerance}",
    ("Its records end after they arrived, so the times of earthquakes are wrong: set its clock.",),
)
SERVER_CLOCK = Wording(
    "The clocks of the monitoring server and of this server differ by more than {tolerance}",
    ("The monitoring server's clock is {ahead}: set the one that is wrong.",),
)
DEAD_CHANNEL = Wording(
    "Sensor {channel} gave no usable record in {misses} earthquakes or more",
    (
        "Its measurements are missing from the results: have the sensor and its cable checked.",
        "In the latest earthquake, event {event}{files}: {finding}.",
    ),
)
NO_SAMPLES = "it sent no samples"
SILENT_CHANNEL = Wording(
    "Sensor {channel} has sent nothing for more than {duration}",
    (
        "Other sensors of the building still send: have this sensor and its cable checked.",
        "Its measurements of the next earthquake will be missing.",
    ),
)
WORK_WAITS = Wording(
    "Records have waited for their analysis for more than {duration}",
    ("They are stored, but there are no results until the worker runs again (menshin work, or menshin up).",),
)
DISK_FULL = Wording(
    "Less than {gibibytes:.1f} GiB of disk space is free for the database",
    ("Once the disk is full, no earthquake can be stored: free some space, or use a larger disk.",),
)
