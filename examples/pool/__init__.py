"""A tiled test tank: targets at known distances in clean water."""
