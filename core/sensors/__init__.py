"""Sensors: records on one time base, screened, oriented and compared, with one motion for each level and direction."""
