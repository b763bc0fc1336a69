"""The hidden laws."""
