"""Alerts: from a finding to what people hear, decide and do, with its history."""
