"""The API of health and metrics."""
