"""What surrounds the particles: walls, the periodic cell, pushes from outside, and their motion."""
