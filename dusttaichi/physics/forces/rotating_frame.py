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
def acceleration(constants, particle):
    """Coriolis and centrifugal acceleration."""
    outward = constants.rotation.cross(constants.centre - particle.position)
    return 2.0 * particle.velocity.cross(constants.rotation) + constants.rotation.cross(outward)


@ti.func
def angular_acceleration(constants, particle):
    """Change of the spin of a sphere whose inertial spin stays."""
    return particle.spin.cross(constants.rotation)


@ti.func
def potential(constants, particle):
    """Energy of the centrifugal force; the Coriolis force does no work."""
    return (
        -0.5
        * particle.mass
        * constants.rotation.cross(particle.position - constants.centre).norm_sqr()
    )
