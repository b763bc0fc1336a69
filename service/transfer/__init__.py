"""A building with everything it has as one file, which another installation takes in: docs/operate/moving.md."""
