"""The estimator that tells all floors together, by a superstructure calibrated from the record."""
