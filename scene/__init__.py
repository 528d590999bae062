"""Puts water into a scene, takes it out again, and renders its bands."""
