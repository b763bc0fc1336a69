"""Telling people and programs: the outbox, the senders, and what became of every message."""
