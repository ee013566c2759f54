"""Sticking speed and restitution of the collision of a scene: many speeds, a request each."""
