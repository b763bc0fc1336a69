"""Estimators of the isolation layer's restoring force: component mode synthesis, and a calibrated frame."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

from core.estimators import cms
from core.estimators.frame import estimator as frame_estimator
from core.estimators.result import RestoringForce
from core.estimators.superstructure import InstrumentedSuperstructure

Estimator = Callable[[InstrumentedSuperstructure], RestoringForce]

ESTIMATORS: Mapping[str, Estimator] = MappingProxyType(
    {cms.NAME: cms.estimate, frame_estimator.NAME: frame_estimator.estimate}
)
"""The estimators by the name that settings and stored results use."""
