"""Jobs: the queue in the database, and the worker; the kinds of jobs belong to the rooms above."""
