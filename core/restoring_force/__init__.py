"""The isolation layer's restoring force: what an estimator of it is, and the paper's."""
