"""The API of recordings, and the FDSN web services."""
