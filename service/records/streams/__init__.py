"""Live streams: packets of a SeedLink server, kept in the database, and the earthquakes cut out of them."""
