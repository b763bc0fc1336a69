"""The API of earthquakes, their series and their pictures."""
