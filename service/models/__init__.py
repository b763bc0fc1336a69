"""Models of isolation layers: their versions, fits, comparisons and diagnoses."""
