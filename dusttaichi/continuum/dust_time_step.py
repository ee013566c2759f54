"""Length of an output step, the step of the run; the time steps of the method are in kernels."""

import numpy as np

from dusttaichi.errors import DustError

STEPS = 8  # of the method in an output step, at the start


def output_step(scene, fastest):
    """Length of an output step [s]; fastest: the fastest initial signal [m/s].

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
