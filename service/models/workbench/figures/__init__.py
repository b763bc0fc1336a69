"""The pictures of a model held against records: each module draws from one kind of result."""
