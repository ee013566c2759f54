"""Smoothing kernels of support 2 h, as slope F(r) with grad W = F x; h: smoothing length.

Both are written without branches, so that a loop over neighbours has none.
"""

from math import pi

from dusttaichi.compute.engine import ti
from dusttaichi.continuum.kernels.store import TINY

CLOSE = 0.01  # of h^2, keeps a viscosity finite where particles meet


@ti.func
def cubic_spline(r2, inv_h, scale):
    """Cubic spline (Monaghan & Lattanzio 1985): F = scale (4 (1-q)+^2 - (2-q)+^2)/q, q = r/h.

    That is 3 q - 4 up to q = 1, and 4 - q - 4/q up to q = 2, where it is exactly 0.
    """
    s = r2 * inv_h * inv_h + TINY
    s = ti.select(s < 4.0, s, 4.0)
    q = ti.sqrt(s)
    return scale * ti.select(s < 1.0, 3.0 * q - 4.0, 4.0 - q - 4.0 / q)


@ti.func
def wendland_c2(r2, inv_h, scale):
    """Wendland (1995) C2: F = -scale (1 - q/2)+^3, q = r/h."""
    half = 1.0 - 0.5 * ti.sqrt(r2) * inv_h
    half = ti.select(half > 0.0, half, 0.0)
    return -scale * half * half * half


KERNELS = {"cubic_spline": cubic_spline, "wendland_c2": wendland_c2}
# scale h^(dimension + 2)
_SCALES = {
    ("cubic_spline", 2): 0.75 * 10.0 / (7.0 * pi),
    ("cubic_spline", 3): 0.75 / pi,
    ("wendland_c2", 2): 5.0 * 7.0 / (4.0 * pi),
    ("wendland_c2", 3): 5.0 * 21.0 / (16.0 * pi),
}


def scale(kernel, dimension, h):
    """The factor that makes the integral of the kernel 1; h: smoothing length [m]."""
    return _SCALES[kernel, dimension] / h ** (dimension + 2)


@ti.pyfunc
def cubic_shape(q):
    """The cubic spline but for its factor."""
    far, near = max(2.0 - q, 0.0), max(1.0 - q, 0.0)
    return 0.25 * far * far * far - near * near * near


@ti.pyfunc
def wendland_shape(q):
    """Wendland's C2 but for its factor."""
    half = max(1.0 - 0.5 * q, 0.0)
    return half * half * half * half * (2.0 * q + 1.0)


SHAPES = {"cubic_spline": cubic_shape, "wendland_c2": wendland_shape}
