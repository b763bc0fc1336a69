"""The frame estimator: all floors together from those measured, by a frame that is calibrated from the record."""
