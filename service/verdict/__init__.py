"""The verdict: what may be said of a building after an earthquake, as one pure function of stored facts."""
