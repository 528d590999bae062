"""What is seen of a scene: cameras, surfaces, lamps, their files. Reads, and changes nothing."""
