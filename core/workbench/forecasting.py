"""Forecast of a building's response to given ground motions."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from core.errors import RecordError
from core.fitting.observation import Observation
from core.forecasting.experience import Experience, experience
from core.forecasting.ground_motion import GroundMotion, Scaling
from core.forecasting.response import Forecast, Forecaster, Peak, Quantity, Setting
from core.model.isolator import Isolator
from core.rounding import interval, plain
from core.tables import Table, report
from core.workbench.comparing import counted
from core.workbench.earthquakes import Earthquakes, model_errors
from core.workbench.progress import Progress, silent

UNITS = {"displacement": ("mm", 1e3), "acceleration": ("m/s²", 1.0), "drift": ("mm", 1e3)}
"""Units that engineers read, and their number per SI unit, by quantity."""


@dataclass(frozen=True, slots=True, eq=False)
class ForecastResult:
    """Responses to ground motions, in the order in which these were given."""

    model: Isolator
    earthquakes: Earthquakes
    """Records that the model's values and its error are taken from."""
    experience: Experience
    forecasts: tuple[Forecast, ...]
    sources: tuple[str, ...]
    """Sources of the superstructures."""

    def __str__(self) -> str:
        title = f"Forecast with {', '.join(self.model.effects)}, known from {counted(self.earthquakes)}"
        parts = [part for one in self.forecasts for part in (forecast_table(one), forecast_sentences(one))]
        return report(title, *parts, self.sources)


def forecast(
    model: Isolator,
    earthquakes: Earthquakes | Sequence[Observation],
    motions: GroundMotion | Sequence[GroundMotion],
    *,
    scaling: Scaling | None = None,
    at: datetime | None = None,
    temperature: float | None = None,
    progress: Progress = silent,
) -> ForecastResult:
    """Forecast the response of isolators and floors to ground motions, with 95 % intervals.

    The intervals hold the covariance of the model's values, as the records leave it, and the error of the model's
    predictions of the records from their ground motion alone. A motion that leaves the range of the records is named.

    Args:
        model: with values that were fitted to the records.
        earthquakes: the records, of one building that is described; those held out only show the model's error.
        motions: of the ground below the isolators.
        scaling: of every motion; None for the motions as they are.
        at: start of the motions, aware; None for the end of the last record.
        temperature: °C, of the isolators; None for the middle of the records'.
        progress: called with each step.

    Raises:
        RecordError: no observation, no motion, a motion without the model's direction, or an impossible scaling.
        ModelError: the model's force or response grew beyond all bounds.
    """
    seen, wanted = Earthquakes.of(earthquakes), [motions] if isinstance(motions, GroundMotion) else list(motions)
    if not wanted:
        raise RecordError("there is no ground motion; give one")
    progress("comparing the model with the records", 0, len(wanted) + 1)
    by, sources = forecaster(model, seen)
    setting, forecasts = Setting(at=at, temperature=temperature), []
    for number, motion in enumerate(wanted, start=1):
        progress(f"forecasting the response to {motion.name}", number, len(wanted) + 1)
        forecasts.append(by.forecast(motion, scaling, setting))
    progress("forecast", len(wanted) + 1, len(wanted) + 1)
    return ForecastResult(model, seen, by.experience, tuple(forecasts), sources)


def forecaster(model: Isolator, earthquakes: Earthquakes) -> tuple[Forecaster, tuple[str, ...]]:
    """A model with all that its records teach, and the sources of its superstructures.

    Args:
        model: with values that were fitted to the records.
        earthquakes: the records.

    Raises:
        RecordError: the building is not described, its superstructure is not known, or every earthquake is held out.
        ModelError: the model's force grew beyond all bounds.
    """
    description = earthquakes.description
    if description is None:
        raise RecordError("the building is not described, so its floors cannot be forecast; describe it")
    if not earthquakes.fitted:
        raise RecordError("every earthquake is held out; keep one that the model was fitted to")
    known = {direction: earthquakes.superstructure(direction) for direction in earthquakes.directions}
    if reasons := [f"direction {key}: {one}" for key, one in known.items() if isinstance(one, str)]:
        raise RecordError("; ".join(reasons))
    found = {key: one for key, one in known.items() if not isinstance(one, str)}
    errors = model_errors(model, earthquakes)
    modes = {key: one.modes for key, one in found.items()}
    learnt = experience(model, errors.forces, errors.predictions, earthquakes.fitted, modes, description)
    sources = tuple(f"direction {key}: {one.source}" for key, one in found.items())
    return Forecaster(model, earthquakes.directions, description, learnt, earthquakes.reference), sources


def last_end(earthquakes: Earthquakes) -> datetime:
    """End of the last record."""
    return max(one.start + timedelta(seconds=(one.layer.force.size - 1) / one.rate) for one in earthquakes.observations)


def forecast_table(one: Forecast) -> Table:
    """Peaks of a forecast with their intervals."""
    several = len(one.courses) > 1
    rows = tuple((f"{named(peak)}{f', {peak.direction}' if several else ''}", *_cells(peak)) for peak in one.peaks)
    caption = f"{one.motion.name}, scaled by {plain(one.factor, 3)}" if one.factor != 1 else one.motion.name
    headings = ("peak", "forecast", "95 % interval", "values", "model")
    note = "Values, model: standard deviations by the values' covariance and by the model's own error."
    return Table(caption, headings, rows, note)


def forecast_sentences(one: Forecast) -> tuple[str, ...]:
    """Warnings and remarks on a forecast."""
    pga = f"Peak ground acceleration: {plain(one.motion.pga, 3)} m/s²."
    if not one.is_out_of_range:
        return (pga, *one.remarks)
    return (pga, "OUT OF RANGE: the records do not show how reliable this forecast is.", *one.beyond, *one.remarks)


NAMES: dict[Quantity, str] = {
    "displacement": "displacement of the isolators",
    "acceleration": "acceleration, {level}",
    "drift": "storey below {level}",
}


def named(peak: Peak) -> str:
    """Name of what a peak is of."""
    return NAMES[peak.quantity].format(level=peak.level)


def written(peak: Peak) -> str:
    """A peak with its interval, to the digits that this supports."""
    unit, factor = UNITS[peak.quantity]
    return interval(factor * peak.value, factor * peak.low, factor * peak.high, unit, signed=False)


def _cells(peak: Peak) -> tuple[str, ...]:
    value, _, ends = written(peak).partition(" (95 %: ")
    return value, ends.rstrip(")"), f"{100 * peak.by_values:.1f} %", f"{100 * peak.by_model:.1f} %"
