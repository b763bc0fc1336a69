"""The superstructure's modes from its recorded motion."""
