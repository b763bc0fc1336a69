"""Watching for drift: what was measured over the years, what of it is not as expected, and what people say of it."""
