"""Alerts: what is found of a building becomes what people are told, once, and keeps its history."""
