"""Environment of the particles: walls, periodic cell, their motion and its control, and time."""
