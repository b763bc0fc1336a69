"""Pictures: how they are defined, thinned and written."""
