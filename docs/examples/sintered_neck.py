"""An effect of your own: necks between grains that have touched at the start (sintered dust).

A neck is a short elastic rod of radius a and length a in each contact of the start, in parallel to
the bare contact (Potyondy & Cundall 2004): against stretching k_n = E pi a^2/a, shear k_n/(2 (1 +
nu)), bending E pi a^4/4/a and twisting half of that over (1 + nu). It breaks, into the bare
contact, where the tension of its outermost fibre, N/(pi a^2) + 4 M/(pi a^3), exceeds its strength,
a property of the material that this file brings into the YAML; what it had stored goes to the
channel `neck` of the ledger.

    extensions: [sintered_neck.py]
    material: {base: silicate_s12, properties: {neck_strength: 50 MPa}}
    interaction: {effects: {neck: {radius: 0.05}}}
"""

from math import pi
from typing import Annotated

from pydantic import Field

from dusttaichi import ti
from dusttaichi.physics.contact import register
from dusttaichi.physics.contact.effect_numbers import Constant, History, Property
from dusttaichi.physics.contact.kinematics import across
from dusttaichi.scene.fields import Block, Number


class Neck(Block):
    """The key of the effect."""

    radius: Annotated[float, Number(gt=0, le=0.5)] = Field(
        0.05, description="radius of a neck over twice the reduced radius of its grains"
    )


class SinteredNeck:
    """History of a contact with a neck, and the load of the neck."""

    MATERIAL = {"neck_strength": Property("pressure", "tensile strength of a sintered neck")}
    NUMBERS = {
        "neck_stretch": Constant("N/m", "stiffness against stretching"),
        "neck_shear": Constant("N/m", "against shear"),
        "neck_bend": Constant("N/m", "against bending, for a displacement R theta"),
        "neck_twist": Constant("N m", "against twisting"),
        "neck_force": Constant("N", "tension that breaks it"),
        "neck_lever": Constant("1", "tension over that of the bending force R k theta"),
    }
    HISTORY = {
        "neck": History("1", "1 where a neck is whole, -1 where there is none", 1, "neck"),
        "neck_rest": History("m", "overlap when it was new", 1, "neck_rest"),
        "neck_phi": History("rad", "twist of the neck", 1, "neck_twist"),
        "neck_xi": History("m", "bending, as a rolling displacement", 3, "neck_bending"),
        "neck_zeta": History("m", "shear", 3, "neck_shear", odd=True),
    }
    CHANNEL = "neck"
    STIFFNESS = {
        "k_n": "neck_stretch",
        "k_s": "neck_shear",
        "k_r": "neck_bend",
        "k_t": "neck_twist",
    }
    MASKED = True  # it decides itself what remains where grains do not touch

    @staticmethod
    @ti.pyfunc
    def numbers(c, block):
        a, E = block.radius * 2.0 * c.R_pair, c.E_star * 2.0 * (1.0 - c.nu * c.nu)
        bend = E * pi * a**3 / 4.0
        return {
            "neck_stretch": E * pi * a,
            "neck_shear": E * pi * a / (2.0 + 2.0 * c.nu),
            "neck_bend": bend / c.R**2,
            "neck_twist": bend / (1.0 + c.nu),
            "neck_force": c.neck_strength * pi * a**2,
            "neck_lever": 4.0 * c.R / a,
        }

    @staticmethod
    @ti.func
    def elastic_energy(motion: ti.template(), history: ti.template(), constants):
        """Energy of a whole neck."""
        d = motion.overlap - history.neck_rest
        sheared = 0.5 * constants.neck_shear * history.neck_zeta.dot(history.neck_zeta)
        bent = 0.5 * constants.neck_bend * history.neck_xi.dot(history.neck_xi)
        turned = 0.5 * constants.neck_twist * history.neck_phi * history.neck_phi
        return 0.5 * constants.neck_stretch * d * d + sheared + bent + turned

    @staticmethod
    @ti.func
    def update(motion: ti.template(), history: ti.template(), constants, dt):
        # contacts of the start have necks, but for those that a sample brings along without
        new_neck = ti.select(dt > 0.0, 0.0, 1.0 - history.neck * history.neck)
        intact_before = new_neck * motion.touches + ti.max(history.neck, 0.0)
        history.neck_rest = new_neck * motion.overlap + (1.0 - new_neck) * history.neck_rest
        history.neck_xi = intact_before * across(
            history.neck_xi + motion.rolling_rate * dt, motion.normal
        )
        history.neck_zeta = intact_before * across(
            history.neck_zeta + motion.sliding_rate * dt, motion.normal
        )
        history.neck_phi = intact_before * (
            history.neck_phi + (motion.rotation_1 - motion.rotation_2).dot(motion.middle)
        )
        bending = constants.neck_bend * ti.sqrt(history.neck_xi.dot(history.neck_xi))
        tension = (
            constants.neck_stretch * (history.neck_rest - motion.overlap)
            + constants.neck_lever * bending
        )
        intact = ti.select(tension > constants.neck_force, 0.0, intact_before) * motion.touches
        history.neck = 2.0 * intact - 1.0
        return (intact_before - intact) * SinteredNeck.elastic_energy(motion, history, constants)

    @staticmethod
    @ti.func
    def evaluate(motion: ti.template(), history: ti.template(), constants, load: ti.template()):
        intact = ti.max(history.neck, 0.0)
        shear = history.neck_zeta * (-constants.neck_shear * intact)
        couple = (history.neck_xi * (constants.R * constants.neck_bend * intact)).cross(
            motion.normal
        )
        couple += motion.normal * (constants.neck_twist * history.neck_phi * intact)
        turn = motion.normal.cross(shear) * (1.0 - motion.overlap * constants.inv_sum)
        load.push += constants.neck_stretch * (motion.overlap - history.neck_rest) * intact
        load.force += shear
        load.torque_1 -= couple + turn * constants.r1
        load.torque_2 += couple - turn * constants.r2
        return intact * SinteredNeck.elastic_energy(motion, history, constants)


register("effects", "neck", SinteredNeck, Neck)
