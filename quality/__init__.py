"""What a scene requires."""
