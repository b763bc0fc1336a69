"""Monitored buildings: their descriptions, recipients and reference periods."""
