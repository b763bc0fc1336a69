"""What the API takes and answers: names, units and meaning of every value."""
