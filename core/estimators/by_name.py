"""The estimators of the restoring force, by name."""

from collections.abc import Mapping
from types import MappingProxyType

from core.estimators import cms
from core.estimators.estimator import Estimator
from core.estimators.frame import smoother

ESTIMATORS: Mapping[str, Estimator] = MappingProxyType({cms.NAME: cms.estimate, smoother.NAME: smoother.estimate})
