"""Retention: what the settings allow to delete, what keeps the rest, and the deletion."""
