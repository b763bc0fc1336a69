"""The observations of a trial in which an effect is hidden, as the product's analysis makes them."""

from hidden.trial import Trial

from core.analysis import AnalysisSettings, analyse
from core.fitting.observation import Observation, observations
from core.record import Segment


def observed_along_x(made: Trial) -> list[Observation]:
    """Observations along x of the earthquakes for fitting."""
    seen = []
    for number, event in enumerate(made.fitted):
        parts = zip(event.record.channels, event.record.samples, strict=True)
        segments = [Segment(channel.id, event.start, event.record.rate, samples) for channel, samples in parts]
        found = analyse(segments, made.description, AnalysisSettings())
        seen += [one for one in observations(found, made.description, f"event {number}") if one.direction == "x"]
    return seen
