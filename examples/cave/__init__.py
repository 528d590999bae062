"""A cave one can swim through: a rock with a tunnel, and holes in its roof."""
