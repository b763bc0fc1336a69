"""The force that a model lacks: its size, what it depends on, and the simplest law for it."""
