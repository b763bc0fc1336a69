"""Results of analyses: stored, queried and shown."""
