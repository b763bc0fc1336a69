"""Rendered messages and recipients."""

import base64
from dataclasses import replace
from datetime import UTC, datetime

from service.notify.rendering import RenderedMessage

KEY = "whsec_" + base64.b64encode(bytes(range(32))).decode()
"""A secret of a webhook."""
WRITTEN = datetime(2024, 3, 1, 5, 6, 7, tzinfo=UTC)


def rendered_message(**other: object) -> RenderedMessage:
    """One about an earthquake without consequences; `other` is what differs."""
    usual = RenderedMessage(
        identity="msg_2",
        first_identity="msg_2",
        key="event/17",
        number=1,
        building_code="TOWER",
        building_name="Tower ö",
        timezone="Asia/Tokyo",
        kind="event",
        sequence="new",
        severity="normal",
        gravest="normal",
        subject="Earthquake of 1 March 2024, 14:02: normal: 8 of 8 checks passed",
        sentences=("The isolators moved by 31 mm at most.", "Normal. This does not replace an inspection."),
        facts=(("Largest displacement", "31 mm"), ("Largest acceleration of the ground", "82 gal")),
        link="https://menshin.example.org/events/17",
        data={"peak_displacement": 0.031},
        began_at=WRITTEN,
        written_at=WRITTEN,
        is_repeat=False,
    )
    return replace(usual, **other)  # type: ignore[arg-type]
