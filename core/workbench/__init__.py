"""The workbench: a model of the isolation layer is fitted, compared, diagnosed, improved and used for forecasts.

Each operation takes a model and observations, and returns a result that prints a report. Notebooks, the command line
and the service all call these.
"""

from core.workbench.added_sensors import AddedSensors, added_sensors
from core.workbench.comparing import ComparisonResult, compare
from core.workbench.diagnosing import diagnose
from core.workbench.diagnosis_result import DiagnosisResult
from core.workbench.earthquakes import Earthquakes
from core.workbench.fitting import FitResult, fit
from core.workbench.forecasting import ForecastResult, forecast
from core.workbench.improving import ExtensionResult, ImprovementResult, add, improve
from core.workbench.sketching import SketchResult, sketch

__all__ = [
    "AddedSensors",
    "ComparisonResult",
    "DiagnosisResult",
    "Earthquakes",
    "ExtensionResult",
    "FitResult",
    "ForecastResult",
    "ImprovementResult",
    "SketchResult",
    "add",
    "added_sensors",
    "compare",
    "diagnose",
    "fit",
    "forecast",
    "improve",
    "sketch",
]
