"""What the example scenes are made of: shapes, materials, corals, fish, and a builder."""
