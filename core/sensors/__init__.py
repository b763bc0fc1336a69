"""The sensors of a building: is each fit for use, and do they agree?"""
