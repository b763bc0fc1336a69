"""A model of the isolation layer, driven along a motion or simulated under its building."""
