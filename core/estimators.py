"""The estimators of the restoring force, by name."""

from collections.abc import Mapping
from types import MappingProxyType

from core.restoring_force import cms
from core.restoring_force.estimator import Estimator
from core.smoothing import smoother

ESTIMATORS: Mapping[str, Estimator] = MappingProxyType({cms.NAME: cms.estimate, smoother.NAME: smoother.estimate})
