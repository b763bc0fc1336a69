"""The model workbench on files: models, records, and reports for engineers."""
