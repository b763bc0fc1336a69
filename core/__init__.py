"""Numerics of base-isolated buildings: values in, values out.

The names below are the library; docs/models/library.md describes each in a line and shows them at work. A name is
imported at its first use, so that `import core` costs nothing; the laws of the effects are compiled when a model is
first simulated. All quantities are in SI units, and every result prints a report.

From arrays: `restoring_force`, `layer_motion`, `equivalents`, `Observation`.
From records: `BuildingDescription`, `Level`, `IsolationLayer`, `IsolationDesign`, `Channel`, `Segment`, `analyse`,
`AnalysisSettings`, `EventAnalysis`, `observations`.
Models: `Isolator`, `first_model`, `EFFECTS`, `Effect`, `Parameter`, `LogNormal`, `Normal`, `add_effect`.
Simulation: `ShearBuilding`, `simulate`.
Drift: `drift_series`, `monitor`.
Sensors: `added_sensors`.
The workbench: `fit`, `compare`, `diagnose`, `add`, `improve`, `sketch`, `Earthquakes`.
Forecasts: `forecast`, `GroundMotion`, `ToPga`, `ToDisplacement`, `ToSpectrum`.
Errors: `CoreError`, `RecordError`, `ModelError`, `IdentificationError`.
"""

from importlib import import_module
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from core.analysis import AnalysisSettings, EventAnalysis, analyse
    from core.building import ShearBuilding
    from core.description import BuildingDescription, IsolationDesign, IsolationLayer, Level
    from core.drift.from_analyses import drift_series
    from core.drift.monitor import monitor
    from core.effect import Effect, LogNormal, Normal, Parameter
    from core.effects import EFFECTS, add_effect
    from core.errors import CoreError, IdentificationError, ModelError, RecordError
    from core.estimates import equivalents, layer_motion, restoring_force
    from core.fitting.observation import Observation, observations
    from core.forecasting.ground_motion import GroundMotion, ToDisplacement, ToPga, ToSpectrum
    from core.model.first_model import first_model
    from core.model.isolator import Isolator
    from core.model.simulation import simulate
    from core.record import Channel, Segment
    from core.workbench import Earthquakes, add, added_sensors, compare, diagnose, fit, forecast, improve, sketch

__all__ = [
    "EFFECTS",
    "AnalysisSettings",
    "BuildingDescription",
    "Channel",
    "CoreError",
    "Earthquakes",
    "Effect",
    "EventAnalysis",
    "GroundMotion",
    "IdentificationError",
    "IsolationDesign",
    "IsolationLayer",
    "Isolator",
    "Level",
    "LogNormal",
    "ModelError",
    "Normal",
    "Observation",
    "Parameter",
    "RecordError",
    "Segment",
    "ShearBuilding",
    "ToDisplacement",
    "ToPga",
    "ToSpectrum",
    "add",
    "add_effect",
    "added_sensors",
    "analyse",
    "compare",
    "diagnose",
    "drift_series",
    "equivalents",
    "first_model",
    "fit",
    "forecast",
    "improve",
    "layer_motion",
    "monitor",
    "observations",
    "restoring_force",
    "simulate",
    "sketch",
]

_MODULES = MappingProxyType(
    {
        "core.analysis": (
            "AnalysisSettings",
            "EventAnalysis",
            "analyse",
        ),
        "core.building": ("ShearBuilding",),
        "core.description": (
            "BuildingDescription",
            "IsolationDesign",
            "IsolationLayer",
            "Level",
        ),
        "core.drift.from_analyses": ("drift_series",),
        "core.drift.monitor": ("monitor",),
        "core.effect": (
            "Effect",
            "LogNormal",
            "Normal",
            "Parameter",
        ),
        "core.effects": (
            "EFFECTS",
            "add_effect",
        ),
        "core.errors": (
            "CoreError",
            "IdentificationError",
            "ModelError",
            "RecordError",
        ),
        "core.estimates": (
            "equivalents",
            "layer_motion",
            "restoring_force",
        ),
        "core.model.first_model": ("first_model",),
        "core.fitting.observation": (
            "Observation",
            "observations",
        ),
        "core.forecasting.ground_motion": (
            "GroundMotion",
            "ToDisplacement",
            "ToPga",
            "ToSpectrum",
        ),
        "core.model.isolator": ("Isolator",),
        "core.model.simulation": ("simulate",),
        "core.record": (
            "Channel",
            "Segment",
        ),
        "core.workbench": (
            "Earthquakes",
            "add",
            "added_sensors",
            "compare",
            "diagnose",
            "fit",
            "forecast",
            "improve",
            "sketch",
        ),
    }
)
"""Names of the library by the module that defines them."""


def __getattr__(name: str) -> Any:  # noqa: ANN401  a class, a function or a value
    module = next((module for module, names in _MODULES.items() if name in names), None)
    if module is None:
        raise AttributeError(f"module 'core' has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(module), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
