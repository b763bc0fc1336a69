"""The API of models and effects."""
