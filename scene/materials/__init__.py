"""The materials of a scene: read, and sent through the water."""
