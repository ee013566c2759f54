"""The length of a beat, what the run counts as a step; the method's own steps are in kernels."""

import numpy as np

from dusttaichi.errors import DustError

STEPS = 8  # of the method in a beat, at the start


def beat(scene, fastest):
    """Length of a beat [s]; fastest: the fastest signal of the start [m/s].

    Raises DustError where nothing says how long it is.
    """
    numerics = scene.numerics
    if numerics.time_step != "auto":
        return numerics.time_step
    if not (np.isfinite(fastest) and fastest > 0.0):
        raise DustError(
            "numerics.time_step = auto: there is no dust whose speed of sound a step could be "
            'taken from; give a step, for example "10 us"'
        )
    return STEPS * numerics.cfl * numerics.smoothing_length / fastest
