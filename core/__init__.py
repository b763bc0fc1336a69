"""Numerics of base-isolated buildings: values in, values out."""
