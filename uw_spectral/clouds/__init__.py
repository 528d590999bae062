"""Matter that floats in a part of the water: clouds of silt, plumes, blooms."""
