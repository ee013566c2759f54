"""Environment of the particles: walls, periodic cell, gravity, external pushes, and motion."""
