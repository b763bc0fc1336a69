"""The health of the service itself: readiness, the heartbeat's facts and metrics."""
