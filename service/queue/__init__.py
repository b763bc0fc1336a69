"""Work that waits in the database, and how far it has come."""
