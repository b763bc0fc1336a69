"""Alerts: from a candidate to messages, acknowledgement and inspection, with their history."""
