"""EEVEE and Cycles: what they need of a scene, and the passes that they render."""
