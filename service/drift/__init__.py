"""Drift: changes of a building's isolators over the years, followed from earthquake to earthquake."""
