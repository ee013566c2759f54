"""Environment of the particles: walls, periodic cell, external pushes, and their motion."""
