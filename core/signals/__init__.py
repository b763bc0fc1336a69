"""Histories as signals, whatever they measure: filtered, resampled, and how noisy they are."""
