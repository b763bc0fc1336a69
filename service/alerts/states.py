"""Which states an alert has, and what they mean."""

from collections.abc import Mapping

PENDING, ON_HOLD, ACTIVE, ACKNOWLEDGED = "pending", "on_hold", "active", "acknowledged"
RESOLVED, WITHDRAWN = "resolved", "withdrawn"

MEANINGS: Mapping[str, str] = {
    PENDING: "evidence is gathering; no message is sent yet",
    ON_HOLD: "another alert may explain it; it becomes active if the evidence remains once that one has ended",
    ACTIVE: "there is enough evidence, and messages are sent",
    ACKNOWLEDGED: "a person is looking after it",
    RESOLVED: "settled, by an inspection or because it is no longer so",
    WITHDRAWN: "it never was so, as better data or a review showed",
}
NAMES: Mapping[str, str] = {state: state.replace("_", " ") for state in MEANINGS} | {PENDING: "under review"}
"""As people read them."""
STANDING = frozenset({ACTIVE, ACKNOWLEDGED})
"""States of what people were told and that is not settled."""
CLOSED = frozenset({RESOLVED, WITHDRAWN})
