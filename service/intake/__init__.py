"""From files as they come to earthquakes that wait to be analysed."""
