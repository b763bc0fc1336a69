"""The verdict on a building after an earthquake: one pure function of stored facts."""
