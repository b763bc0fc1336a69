"""What does the loop look like that a message shows?"""

import numpy as np
import vl_convert
from sqlalchemy.orm import Session

from service.analyses import queries as analysis_queries
from service.db.blobs import decode
from service.errors import NotFoundError
from service.notify.letter import DRILL, TEST
from service.reports import charts as report_charts

SCALE = 2.0
"""Pixels of the picture to one of the chart, for screens of today."""
MARKS = {"drill": f"{DRILL}, from an earlier earthquake", "test": f"{TEST}, from an earlier earthquake"}


def loop(session: Session, event_id: int, direction: str, kind: str) -> bytes | None:
    """Force over displacement of the isolation layer in an event, by its latest analysis, as PNG.

    Returns:
        None where there is no such result any more, or nothing measured the displacement.
    """
    try:
        result = analysis_queries.restoring_force(session, event_id, direction, None)
        rate, displacement, force = analysis_queries.loop(session, result.id)
    except NotFoundError:
        return None
    displacement, force = decode(displacement), decode(force)
    picture = report_charts.loop(
        time=np.arange(force.size) / rate,
        displacement=displacement,
        force=force,
        title=f"Force in the isolators, direction {direction}",
        subtitle=MARKS.get(kind, ""),
    )
    png: bytes = vl_convert.vegalite_to_png(picture.to_dict(), scale=SCALE)
    return png
