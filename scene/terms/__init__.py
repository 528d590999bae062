"""Terms of light in the water, a room each: read of a scene, drawn by EEVEE, given to Cycles."""
