"""Alert candidates as the rules make them."""

from datetime import UTC, datetime, timedelta

from service.alerts.candidates import AlertCandidate

START = datetime(2024, 1, 1, tzinfo=UTC)
DAY = timedelta(days=1)
CHANNELS = ("XX.DEMO.00.HNX", "XX.DEMO.01.HNX")


def softer_isolators(percent: float = 8.0, **differently: object) -> AlertCandidate:
    """The isolators became softer in x with the first event, as the third one showed."""
    drift = -percent / 100
    return AlertCandidate(
        **{
            "cause": "stiffness/x",
            "kind": "deterioration",
            "is_sure": True,
            "began_at": START,
            "raised_at": START + 2 * DAY,
            "onset_event_id": 1,
            "raised_event_id": 3,
            "event_ids": (1, 2, 3),
            "channels": CHANNELS,
            "evidence": {"drift": drift, "low": drift - 0.01, "high": drift + 0.01},
            "summary": f"The isolators are {percent:.0f} % softer in direction x",
            "sentences": ("They carry the building, and ought to be looked at.",),
        }
        | differently
    )


def gain_error(channel: str = CHANNELS[1], **differently: object) -> AlertCandidate:
    """A sensor reads more than it should since the first event."""
    return AlertCandidate(
        **{
            "cause": f"gain/{channel}",
            "kind": "sensor",
            "is_sure": True,
            "began_at": START,
            "raised_at": START + DAY,
            "onset_event_id": 1,
            "raised_event_id": 2,
            "event_ids": (1, 2),
            "channels": (channel,),
            "evidence": {"drift": 0.08, "low": 0.07, "high": 0.09},
            "summary": f"Sensor {channel} reads 8 % more than its neighbours",
            "sentences": ("It may have been replaced.",),
        }
        | differently
    )


def stopped_data(cause: str = "source", **differently: object) -> AlertCandidate:
    """Data stopped."""
    return AlertCandidate(
        **{
            "cause": cause,
            "kind": "data",
            "is_sure": True,
            "began_at": START,
            "raised_at": START + DAY,
            "evidence": {},
            "summary": "The monitoring server does not answer",
            "sentences": ("Earthquakes from now on may be missed.",),
        }
        | differently
    )
