"""Forces from outside on a particle, one a file; `scene.forces.register` adds one of your own."""
