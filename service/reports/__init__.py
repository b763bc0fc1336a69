"""Parts of all reports: charts, and values in engineers' units."""
