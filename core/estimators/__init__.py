"""Estimators of the isolation layer's restoring force: component mode synthesis, and the frame estimator."""
