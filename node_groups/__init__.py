"""Builders of the node trees: each file makes one, and is its source of truth."""
