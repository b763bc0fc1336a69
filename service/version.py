"""Which code is running."""

from importlib.metadata import version

VERSION = version("menshin")
"""Kept with every result."""
