"""The database: how it is reached, brought up to date and kept safe; what all tables and queries share."""
