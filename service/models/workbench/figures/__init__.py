"""Pictures of a model's comparison with records; each module draws one kind of result."""
