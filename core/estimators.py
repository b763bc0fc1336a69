"""The estimators of the restoring force, by name."""

from collections.abc import Mapping
from types import MappingProxyType

from core import cms, smoother
from core.estimator import Estimator

ESTIMATORS: Mapping[str, Estimator] = MappingProxyType({cms.NAME: cms.estimate, smoother.NAME: smoother.estimate})
