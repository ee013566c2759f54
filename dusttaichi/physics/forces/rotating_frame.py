"""A frame that rotates at a steady rate: centrifugal and Coriolis forces, and their torque.

a = -2 W x v - W x (W x (r - c)) with the angular velocity W of the frame about an axis through c.
Spins are those against the frame; a grain on which nothing acts keeps the inertial spin w + W, so
that dw/dt = -W x w. The energy in the frame, with -m |W x (r - c)|^2 / 2, is conserved.
"""

import numpy as np

from dusttaichi.compute.engine import ti
from dusttaichi.physics.forces.force_numbers import Number

NUMBERS = {"rotation": Number("rad/s", 3), "centre": Number("m", 3)}


def numbers(block):
    """Angular velocity of the frame, and a point of its axis."""
    return {"rotation": block.angular_velocity, "centre": block.centre}


def timescale(block, particles):
    """The period of the rotation over 2 [s], in which Coriolis forces turn a velocity once."""
    rotation = float(np.linalg.norm(block.angular_velocity))
    return np.pi / rotation if rotation > 0.0 else np.inf


@ti.func
def acceleration(p, at):
    """Coriolis and centrifugal acceleration."""
    outward = p.rotation.cross(p.centre - at.position)
    return 2.0 * at.velocity.cross(p.rotation) + p.rotation.cross(outward)


@ti.func
def angular_acceleration(p, at):
    """Change of the spin of a sphere whose inertial spin stays."""
    return at.spin.cross(p.rotation)


@ti.func
def potential(p, at):
    """Energy of the centrifugal force; the Coriolis force does no work."""
    return -0.5 * at.mass * p.rotation.cross(at.position - p.centre).norm_sqr()
