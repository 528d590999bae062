"""A coral reef: a foreground, a sand channel that leads into the blue, reef on both sides."""
