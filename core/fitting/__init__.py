"""A model's parameters from records."""
