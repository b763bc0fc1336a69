"""What is wrong with a model: sensors, storeys and mass first, then the effect that it lacks."""
