"""Water: put into a scene, given its values, taken out again."""
