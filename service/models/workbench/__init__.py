"""The model workbench on files: a model held against records, and what came of it for an engineer."""
