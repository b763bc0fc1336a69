"""A model against what was measured, and where it fails."""
