"""Examination of an installation, for the people who run it: what is wrong, and what helps."""
