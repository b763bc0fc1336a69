"""HTTP: the server with its limits, and what requests, responses and pages of all rooms share."""
