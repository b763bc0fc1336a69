"""The API of messages and recipients."""
