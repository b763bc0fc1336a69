"""Random histories of a healthy or a damaged isolation layer, as series for `core.drift`."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta

import numpy as np

from core.arrays import Vector
from core.drift.series import Measurement, Series

YEAR = 365.2425
START = datetime(2001, 4, 1, tzinfo=UTC)


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """Distributions from which a history is drawn."""

    events: int = 130
    scatter: tuple[float, float] = (0.01, 0.02)
    """Range of the standard deviation between events."""
    own: tuple[float, float] = (0.01, 0.03)
    """Range of the standard deviation between the cycles of an event."""
    outliers: float = 0.02
    """Share of the events with three times the scatter."""
    per_year: tuple[float, float] = (10.0, 60.0)
    has_thermometer: bool = True
    giant: bool = True
    """True if one earthquake, after the first twenty events, is several times the largest."""
    scragging: float = 0.0
    """Share of the stiffness lost in the giant; half of it recovers within a month."""


@dataclass(frozen=True, slots=True, eq=False)
class History:
    """Events of a healthy building."""

    time: Vector
    """(events,) days since START."""
    temperature: Vector
    """(events,) °C."""
    common: Vector
    """(events,) logarithm, common to the cycles of an event: scatter, temperature and scragging."""
    peak: Vector
    """(events,) m, largest amplitude."""
    random: Vector
    """(events,) the part of `common` that is scatter."""
    amplitude: tuple[Vector, ...]
    """m, of each event's cycles in order of time."""
    value: tuple[Vector, ...]
    """Logarithm of N/m, of each cycle."""
    std: float
    """Standard deviation of each cycle's value, as the series states it."""
    giant: int | None
    has_thermometer: bool


def history(plan: Plan, seed: int) -> History:
    """A random history of one building."""
    rng = np.random.default_rng(seed)
    curve, thermal = stiffness_curve(rng), rng.uniform(-0.008, -0.001)
    time = np.cumsum(rng.exponential(YEAR / rng.uniform(*plan.per_year), plan.events))
    temperature = weather(time, rng)
    peak = np.minimum(2e-3 * (1 - rng.random(plan.events)) ** (-1 / 1.3), 0.12)
    giant = int(rng.integers(22, plan.events)) if plan.giant else None
    if giant is not None:
        peak[giant] = peak.max() * rng.uniform(2, 5)
    scatter, own = rng.uniform(*plan.scatter), rng.uniform(*plan.own)
    common = scatter * rng.standard_normal(plan.events) * np.where(rng.random(plan.events) < plan.outliers, 3.0, 1.0)
    random = common
    common = random + thermal * (temperature - 15.0)
    if giant is not None:
        common[giant + 1 :] -= plan.scragging * 0.5 ** ((time[giant + 1 :] - time[giant]) / 30.0)
    amplitudes = tuple(_amplitudes(one, rng) for one in peak)
    values = tuple(
        curve(a) + shift + own * rng.standard_normal(a.size) for a, shift in zip(amplitudes, common, strict=True)
    )
    return History(time, temperature, common, peak, random, amplitudes, values, own, giant, plan.has_thermometer)


def other_direction(plan: Plan, lived: History, seed: int, shared: float) -> History:
    """The same earthquakes and weather in the other direction; its scatter has a correlation with the first's."""
    rng = np.random.default_rng([seed, 2])
    curve, own = stiffness_curve(rng), rng.uniform(*plan.own)
    fresh = float(np.std(lived.random)) * rng.standard_normal(lived.peak.size)
    random = shared * lived.random + np.sqrt(1 - shared**2) * fresh
    common = lived.common - lived.random + random
    peak = lived.peak * rng.uniform(0.6, 1.4, lived.peak.size)
    amplitudes = tuple(_amplitudes(one, rng) for one in peak)
    values = tuple(
        curve(a) + shift + own * rng.standard_normal(a.size) for a, shift in zip(amplitudes, common, strict=True)
    )
    return replace(lived, common=common, peak=peak, random=random, amplitude=amplitudes, value=values, std=own)


def series(lived: History, change: Vector | None = None) -> Series:
    """Stiffness of a history, with (events,) relative changes."""
    changes = np.zeros(lived.time.size) if change is None else change
    found = [
        Measurement(
            event=n,
            time=START + timedelta(days=float(lived.time[n]), seconds=2.0 * m),
            value=float(np.exp(value) * (1 + changes[n])),
            std=float(lived.std * np.exp(value) * (1 + changes[n])),
            amplitude=float(amplitude),
            temperature=float(lived.temperature[n]) if lived.has_thermometer else None,
        )
        for n in range(lived.time.size)
        for m, (amplitude, value) in enumerate(zip(lived.amplitude[n], lived.value[n], strict=True))
    ]
    return Series("stiffness", "x", tuple(found))


def series_in_both_directions(plan: Plan, seed: int, onset: int, loss: float) -> tuple[Series, Series]:
    """Stiffness in x and y of one building with a sudden loss in both; their scatter has a correlation of 0.3."""
    x = history(plan, seed)
    y = other_direction(plan, x, seed, 0.3)
    return series(x, sudden_loss(x, onset, loss)), replace(series(y, sudden_loss(y, onset, loss)), subject="y")


def stiffness_curve(rng: np.random.Generator) -> Callable[[Vector], Vector]:
    """Logarithm of a smoothed bilinear layer's equivalent stiffness, N/m, by amplitude in m."""
    ratio, yielding, stiffness = rng.uniform(0.08, 0.5), rng.uniform(2e-3, 2e-2), 10 ** rng.uniform(7, 9.5)
    hardening = rng.uniform(0.0, 1.0) * 10.0
    sharpness = rng.uniform(0.8, 2.0)

    def curve(amplitude: Vector) -> Vector:
        share = (1 + (amplitude / yielding) ** sharpness) ** (-1 / sharpness)
        relative = ratio + (1 - ratio) * share + ratio * hardening * amplitude**2
        return np.asarray(np.log(stiffness * relative))

    return curve


def weather(days: Vector, rng: np.random.Generator) -> Vector:
    """(events,) °C of the layer: season, hour, and weekly weather."""
    season = rng.uniform(5, 12) * np.sin(2 * np.pi * (days - rng.uniform(0, YEAR)) / YEAR)
    hour = rng.uniform(0, 3) * np.sin(2 * np.pi * days)
    return np.asarray(15.0 + season + hour + 1.5 * rng.standard_normal(days.size))


def sudden_loss(lived: History, onset: int, loss: float) -> Vector:
    """(events,) relative change by a loss that begins with an event."""
    return np.where(np.arange(lived.time.size) >= onset, -loss, 0.0)


def gradual_loss(lived: History, onset: int, loss: float) -> Vector:
    """(events,) relative change by a loss that begins with an event and grows with each."""
    return -loss * np.maximum(0.0, np.arange(lived.time.size) - onset + 1.0)


def series_until(whole: Series, event: int) -> Series:
    """The series as it was before an event."""
    return replace(whole, measurements=tuple(one for one in whole.measurements if one.event < event))


def rescaled(whole: Series, of_value: float, of_amplitude: float) -> Series:
    """The series in other units."""
    return replace(
        whole,
        measurements=tuple(
            replace(
                one,
                value=of_value * one.value,
                std=of_value * one.std,
                amplitude=None if one.amplitude is None else of_amplitude * one.amplitude,
            )
            for one in whole.measurements
        ),
    )


def _amplitudes(peak: float, rng: np.random.Generator) -> Vector:
    """(cycles,) m: a fast rise, and a slow fall to some tenths of the largest."""
    count = int(rng.integers(6, 35))
    rise = max(2, count // 4)
    envelope = np.concatenate([np.linspace(0.2, 1.0, rise), np.geomspace(1.0, rng.uniform(0.05, 0.3), count - rise)])
    return np.asarray(peak * envelope * np.exp(0.25 * rng.standard_normal(count)).clip(0.5, 1.3))
