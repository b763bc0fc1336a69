"""The frame estimator: all floors at once, by a superstructure that is calibrated from the record."""
