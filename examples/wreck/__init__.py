"""A small steel coaster on the sand, her side torn open, her hold dark."""
