"""Search for the particles near each other, for every method."""
