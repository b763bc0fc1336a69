"""Strength of an earthquake at the building, and the motion of the floors above the isolators."""
