"""Reports on a building for paper: on one earthquake, and on one year."""
