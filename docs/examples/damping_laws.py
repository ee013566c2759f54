"""Damping laws of your own: the viscous-adhesive cross term, and dissipation at the crack tip.

`brilliantov` (Brilliantov & Poeschel 2005, cond-mat/0506254): the force is A da/dt dF/da
of the whole JKR force, adhesion included, which is kappa = A dF/d delta with the slope of the force
at the current overlap. The built-in `viscoelastic` has the elastic part alone. Where the slope is
negative, close to pull-off, it would drive: there kappa is 0.

`crack_tip`: opening and closing the crack around a contact of radius a costs w |da/dt|/v0 an area
more than the work of adhesion w = 2 gamma, after the idea of Krijt et al. (2013), linear in the
speed of the crack: the power 2 pi a |da/dt| w |da/dt|/v0 makes kappa = 4 pi gamma a (da/d delta)^2/
v0. It is added to the elastic viscous part. Their own function of the speed is another.

    extensions: [damping_laws.py]
    interaction: {damping: {model: crack_tip, speed: 10 m/s}}
"""

from math import pi
from typing import Annotated, Literal

from pydantic import Field

from dusttaichi import ti
from dusttaichi.physics.contact import register
from dusttaichi.physics.contact.damping import viscoelastic
from dusttaichi.physics.contact.effect_numbers import Constant
from dusttaichi.scene.interaction import Damping
from dusttaichi.scene.quantities import Quantity


class CrossTerm(Damping):
    """The key of `brilliantov`."""

    model: Literal["brilliantov"]
    time: Annotated[float, Quantity("time", gt=0)] = Field(
        "12.5 ps", description="A: relaxation time of the force"
    )


class CrackTip(Damping):
    """The keys of `crack_tip`."""

    model: Literal["crack_tip"]
    time: Annotated[float, Quantity("time", gt=0)] = Field(
        "12.5 ps", description="viscous relaxation time of the elastic part"
    )
    speed: Annotated[float, Quantity("speed", gt=0)] = Field(
        "10 m/s", description="v0: speed of the crack at which its work has doubled"
    )


@ti.pyfunc
def rise(radius):
    """d(a/a0)/d(delta/delta0) of JKR: 2 s/(12 s^3 - 2) with s^2 = a/a0, infinite at pull-off."""
    s = radius**0.5
    slope = 12.0 * s * s * s - 2.0
    return 2.0 * s * slope / (slope * slope + 0.01)  # what is near infinite is made finite


class Brilliantov:
    """kappa = A dF/d delta of JKR."""

    NUMBERS = {
        "kappa": Constant("kg/s", "A times the slope of the force over 3 (s^3 - 1/2) s da/ds")
    }

    @staticmethod
    @ti.pyfunc
    def numbers(c, block):
        # F = 4 F_c (s^6 - s^3), delta0 = a0^2/(3 R)
        return {"kappa": block.time * 4.0 * c.glue * c.F_jkr * 3.0 * c.R / c.a0**2}

    @staticmethod
    @ti.pyfunc
    def coefficient(motion, constants):
        # dF/d(a/a0) = 3 s^4 - 3/2 s, nothing where negative
        s = motion.contact_radius**0.5
        steep = 3.0 * s * s * s * s - 1.5 * s
        return constants.kappa * 0.5 * (steep + abs(steep)) * rise(motion.contact_radius)


class CrackTipLaw:
    """kappa of the built-in viscoelastic law, and that of the crack."""

    NUMBERS = {
        **viscoelastic.NUMBERS,
        "kappa_crack": Constant("kg/s", "4 pi gamma a0^3/(delta0^2 v0)"),
    }

    @staticmethod
    @ti.pyfunc
    def numbers(c, block):
        delta0 = c.a0**2 / (3.0 * c.R)
        crack = 4.0 * pi * c.gamma * c.a0**3 / (delta0**2 * block.speed)
        return {**viscoelastic.numbers(c, block), "kappa_crack": crack}

    @staticmethod
    @ti.pyfunc
    def coefficient(motion, constants):
        steep = rise(motion.contact_radius)
        crack = constants.kappa_crack * motion.contact_radius * steep * steep
        return viscoelastic.coefficient(motion, constants) + crack


register("damping", "brilliantov", Brilliantov, CrossTerm)
register("damping", "crack_tip", CrackTipLaw, CrackTip)
