"""Measurements: accuracy tables and costs, each with the command that repeats it."""
