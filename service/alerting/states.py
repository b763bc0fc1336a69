"""Which states an alert has, and what they mean."""

from collections.abc import Mapping

PENDING, INHIBITED, FIRING, ACKNOWLEDGED = "pending", "inhibited", "firing", "acknowledged"
RESOLVED, WITHDRAWN = "resolved", "withdrawn"

MEANINGS: Mapping[str, str] = {
    PENDING: "evidence is gathering; nobody is told yet",
    INHIBITED: "there is evidence, but a sensor that measures wrongly may explain it; it fires when that is settled",
    FIRING: "there is evidence enough, and people are told",
    ACKNOWLEDGED: "somebody has taken it on",
    RESOLVED: "settled: by an inspection, or because it is no longer so",
    WITHDRAWN: "it was never so, as better data or a review showed",
}
STANDING = frozenset({FIRING, ACKNOWLEDGED})
"""States of what people were told and that is not settled."""
CLOSED = frozenset({RESOLVED, WITHDRAWN})
