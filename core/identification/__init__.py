"""Identification of the superstructure's modes from its recorded motion: subspace, errors in variables, tracking."""
