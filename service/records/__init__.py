"""Records: from a monitoring server's files to earthquakes that wait for their analysis."""
