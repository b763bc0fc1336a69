"""Work that waits in the database, and the worker that does it; kinds of work belong to the rooms above."""
