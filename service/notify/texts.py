"""The texts of this room that people read: the frame of every message, drills and tests, and delivery outcomes.

The sentences of messages about a building are in `service.alerts.texts`, the layout of a mail in `channels/templates`.
"""

DRILL = "DRILL – NOT REAL"
TEST = "TEST – NOT REAL"
MARKS = {"drill": DRILL, "test": TEST}
"""By kind of message."""
NOT_REAL = {
    "drill": "This is a drill. Nothing has happened at the building, and no action is needed.",
    "test": "This is a test of message delivery. Nothing has happened at the building.",
}
SEQUENCES = {"new": "", "updated": "UPDATED", "cancelled": "CANCELLED", "repeat": "REMINDER"}
OPEN_SINCE = "OPEN SINCE {since:%Y-%m-%d}"
SEVERITY_NAMES = {"normal": "normal", "note": "note", "warning": "warning", "alarm": "alarm"}
"""As people read them."""
SEVERITIES = SEVERITY_NAMES | {"alarm": "ALARM"}
"""At the top of a mail."""
NOT_REAL_SEVERITIES = {"drill": "a drill", "test": "a test"}
"""In place of the severity, by kind of message."""
RESENT = "repeat"
MAY_BE_SECOND = (
    "You may already have received this message: it was sent before, but it is not known whether it arrived. Both "
    "copies have the message number below."
)
LINK = "More: {link}"
FOOTER = "{written}, message {identity}"
SENDER = "Menshin"

HAS_ENDED = (
    "You became a recipient on {since} ({zone}). This was written before that, on {written}, and has ended since."
)
STILL_OPEN = (
    "You became a recipient on {since} ({zone}). This was written before that, on {written}, and is still open. "
    "{states}"
)
ALERT_STATE = "Alert {id} is {state}."
ACKNOWLEDGED = "acknowledged by {by} since {at}"

NO_REPORT = "The report on this earthquake could not be made; its page may still have it."
PICTURE_TITLE = "Force in the isolators, direction {direction}"
PICTURE_MARK = "{mark}, from an earlier earthquake"

DRILL_SUBJECT = "An alarm, as a drill"
DRILL_BY = "{by} started this drill."
TEST_SUBJECT = "A test of {name}"
TEST_BY = "{by} requested this test of {name}."
DRILL_CONTENT = (
    "A real message would say here what happened, how far the isolators moved, and whether anything unusual was seen."
)
DELIVERY_WORKS = "If you can read this, messages reach you."
TOO_MANY = (
    "{most} drills and tests were sent for this building within the last hour, the most that are allowed. Try again "
    "later."
)

NO_RECIPIENTS = "no recipients"
NO_SUBSCRIBER = "no recipient is subscribed to messages of this kind and severity"
HIDDEN = "(engineers see it)"
"""In place of values that only engineers see."""

STATES = {
    "waiting": "waiting",
    "sending": "sending",
    "delivered": "delivered",
    "failed": "failed",
    "dropped": "dropped",
}
"""States of deliveries as people read them."""
OUTCOMES = {"delivered": "delivered", "not_taken": "not accepted", "unknown": "unknown", None: "under way"}
"""Outcomes of attempts as people read them; None while one lasts."""
KINDS = {"event": "event", "alert": "alert", "data": "data", "drill": "drill", "test": "test"}
"""Kinds of messages as people read them."""
ORDERS = {"new": "new", "updated": "updated", "cancelled": "cancelled", "repeat": "repeat"}
"""Their relation to earlier messages, after a message's number."""

PROCESS_DIED = "The process that sent it ended before the answer came."
NOT_RENDERED = "the message could not be rendered; see the log"
INTERNAL_ERROR = "internal error; see the log"
