"""Fits of models to records: observations, whitened data, variable projection, search, fit."""
