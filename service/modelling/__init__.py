"""Models of buildings' isolation layers: their versions, and the work on them."""
