"""Models of the isolation layer, their force under a prescribed motion, and the response of buildings on them."""
