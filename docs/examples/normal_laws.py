"""Normal laws of your own: DMT, Hertz without adhesion, and a linear spring with cohesion.

DMT (Derjaguin, Muller & Toporov 1975) is the limit of stiff, small grains: Hertz' contact under a
constant pull, F = 4/3 E* sqrt(R) delta^(3/2) - F_c with F_c = 4 pi gamma R (gamma: of one surface),
which ends at touch. The linear law with cohesion is the one that LIGGGHTS' users know: F = k delta
- c pi R delta, a pull in proportion to the area of contact.

    extensions: [normal_laws.py]
    interaction: {normal: {law: dmt}}
"""

from math import pi
from typing import Annotated

import numpy as np
from pydantic import Field

from dusttaichi import ti
from dusttaichi.physics.contact import register
from dusttaichi.physics.contact.effect_numbers import Constant
from dusttaichi.scene.interaction import NormalLaw
from dusttaichi.scene.quantities import Quantity


class Hertz:
    """F = 4/3 E* sqrt(R) delta^(3/2) - pull, from touch on; the contact radius is sqrt(R delta)."""

    NUMBERS = {
        "hertz": Constant("N m^-1.5", "4/3 E* sqrt(R)"),
        "pull": Constant("N", "constant pull"),
        "reach": Constant("m", "gap at which the contact breaks"),
        "scale": Constant("m^-0.5", "contact radius over that of JKR at rest, at overlap 1 m"),
    }

    def __init__(self, adhesion):  # pull over pi gamma R
        self.adhesion, self.numbers = adhesion, _hertz_numbers(adhesion)

    def response(self, newton_steps):
        """The elastic response of a Motion; there is nothing to iterate."""

        @ti.func
        def respond(motion: ti.template(), constants):
            deep = ti.max(motion.overlap, 0.0)
            root = ti.sqrt(deep)
            motion.contact_radius = constants.scale * root
            force = constants.hertz * deep * root - constants.pull
            energy = 0.4 * constants.hertz * deep * deep * root - constants.pull * deep
            return ti.Struct(force=force, energy=energy)

        return respond

    def rest(self, c):
        """Overlap where elastic force and pull balance."""
        return (self.adhesion * pi * c.gamma * c.R / (4.0 / 3.0 * c.E_star * c.R**0.5)) ** (2 / 3)

    def curve(self, overlap, c):
        """(force [N], energy [J], contact radius over that at rest) at overlaps [m], in NumPy."""
        deep = np.maximum(overlap, 0.0)
        force = c.hertz * deep**1.5 - c.pull
        return force, 0.4 * c.hertz * deep**2.5 - c.pull * deep, c.scale * deep**0.5


def _hertz_numbers(adhesion):
    @ti.pyfunc
    def numbers(c, block):
        return {
            "hertz": 4.0 / 3.0 * c.E_star * c.R**0.5,
            "pull": adhesion * pi * c.glue * c.gamma * c.R,
            "reach": 0.0 * c.R,
            "scale": c.R**0.5 / c.a0,
        }

    return numbers


class LinearKeys(NormalLaw):
    """The keys of the linear law."""

    stiffness: Annotated[float, Quantity("stiffness", gt=0)] = Field(
        "100 N/m", description="normal stiffness"
    )
    cohesion: Annotated[float, Quantity("pressure", ge=0)] = Field(
        "0 Pa", description="cohesion energy density"
    )


class Linear:
    """F = (k - pi R cohesion) delta from touch on."""

    NUMBERS = {
        "spring": Constant("N/m", "stiffness less cohesion"),
        "reach": Constant("m", "gap at which the contact breaks"),
    }

    @staticmethod
    @ti.pyfunc
    def numbers(c, block):
        return {"spring": block.stiffness - pi * c.R * block.cohesion, "reach": 0.0 * c.R}

    @staticmethod
    def response(newton_steps):
        @ti.func
        def respond(motion: ti.template(), constants):
            deep = ti.max(motion.overlap, 0.0)
            motion.contact_radius = 1.0 + 0.0 * deep
            force = constants.spring * deep
            return ti.Struct(force=force, energy=0.5 * force * deep)

        return respond

    rest = staticmethod(lambda c: 0.0)

    @staticmethod
    def curve(overlap, c):
        deep = np.maximum(overlap, 0.0)
        return c.spring * deep, 0.5 * c.spring * deep**2, 1.0 + 0.0 * deep


register("normal", "hertz", Hertz(0.0))
register("normal", "dmt", Hertz(4.0))
register("normal", "linear_cohesion", Linear(), LinearKeys)
