"""The precision that positions of a sample need, and single precision has not."""

import numpy as np

from dusttaichi.errors import DustError

RESOLVED = 0.005  # largest uncertainty of positions over the overlap at rest


def check_precision(scene, sample, delta0):
    """Raise DustError where single precision does not resolve overlaps; delta0 [m]: at rest."""
    resolved = 2.0**-24 * float(np.abs(sample.positions).max())
    if scene.numerics.precision == "f32" and resolved > RESOLVED * delta0:
        raise DustError(
            f"numerics.precision = f32: single precision knows the positions of this sample to "
            f"{resolved * 1e12:.2g} pm, and grains at rest overlap by {delta0 * 1e12:.3g} pm, of "
            f"which {RESOLVED:.1%} must be resolved; try mixed or f64, or a sample below "
            f"{RESOLVED * delta0 * 2.0**24 * 1e6:.2g} µm about the origin"
        )
