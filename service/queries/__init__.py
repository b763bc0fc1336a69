"""Questions to the database, by name: each is one statement."""
