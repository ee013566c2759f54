"""A law of your own: rolling friction that grows with speed.

A contact rolls elastically up to xi_crit, past which it gives way and rolling costs energy. Here
the limit grows with the rolling speed, xi_crit (1 + |dxi/dt|/speed), so that fast rolling is
resisted more, as viscoelastic contacts do; slow rolling is that of the built-in law. The energy
lost enters the ledger with the limit of the moment, so that the ledger closes.

Where this file is imported, the YAML may say

    extensions: [rolling_with_speed.py]
    interaction: {rolling: {law: speed_dependent, modifier: 8, speed: 1 cm/s}}
"""

from typing import Annotated

from pydantic import Field

from dusttaichi import ti
from dusttaichi.physics.contact import register, rolling
from dusttaichi.physics.contact.effect_numbers import Constant
from dusttaichi.physics.contact.limit import limit_displacement
from dusttaichi.scene.interaction import Effect
from dusttaichi.scene.quantities import Quantity


class SpeedDependent(Effect):
    """The keys of the law: those of every effect (law, modifier), and one of its own."""

    speed: Annotated[float, Quantity("speed", gt=0)] = Field(
        "1 cm/s", description="rolling speed at which the limit has doubled"
    )


class RollingWithSpeed:
    """History of a contact for the law, and the functions that compute the loss by rolling."""

    NUMBERS = {
        **rolling.NUMBERS,
        "slowness": Constant("s/m", "one over the speed at which xi_crit doubles"),
    }

    @staticmethod
    @ti.pyfunc
    def numbers(c, block):
        return {**rolling.numbers(c, block), "slowness": 1.0 / block.speed + 0.0 * c.R}

    HISTORY, CHANNEL = rolling.HISTORY, rolling.CHANNEL
    energy = rolling.energy
    evaluate = rolling.evaluate

    @staticmethod
    @ti.func
    def update(motion: ti.template(), history: ti.template(), constants, dt):
        growth = 1.0 + motion.rolling_rate.norm() * constants.slowness
        past = limit_displacement(history.xi, constants.xi_crit * growth, constants.k_r)
        history.xi = history.xi * (1.0 - past.over)
        return past.lost


register("rolling", "speed_dependent", RollingWithSpeed, SpeedDependent)
