"""Diagnosis of a model: faults of sensors, storeys and mass first, then the missing effect."""
