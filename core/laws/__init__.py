"""An effect's law as source: compiled, and differentiated."""
