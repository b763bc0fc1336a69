"""Laws of effects: automatic differentiation and compilation."""
