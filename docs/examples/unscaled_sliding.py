"""A law of your own: sliding that numerics.stiffness_scaling leaves as it is.

Softened contacts have a softer sliding spring and slide past a longer displacement, at the same
force. Here both are those of the unscaled contact, so that a comparison with the built-in law shows
which part of an error comes from sliding (docs/studies/trade.md). Steps are shorter than those of
softened sliding: this spring is the stiffest of the contact.

    extensions: [unscaled_sliding.py]
    interaction: {sliding: {law: unscaled, modifier: 2.5}}
"""

from dusttaichi import ti
from dusttaichi.physics.contact import register, sliding


class UnscaledSliding:
    """The built-in law with the constants of contacts that are not softened."""

    NUMBERS, HISTORY, CHANNEL = sliding.NUMBERS, sliding.HISTORY, sliding.CHANNEL
    energy, update, evaluate = sliding.energy, sliding.update, sliding.evaluate

    @staticmethod
    @ti.pyfunc
    def numbers(c, block):
        softened = sliding.numbers(c, block)
        softer = c.stiffness_scaling ** (2.0 / 3.0)
        return {"k_s": softened["k_s"] / softer, "zeta_crit": softened["zeta_crit"] * softer}


register("sliding", "unscaled", UnscaledSliding)
