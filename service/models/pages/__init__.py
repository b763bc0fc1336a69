"""The pages of models and effects."""
