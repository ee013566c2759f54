"""A plane: x.normal = offset. s: normal (3,) and offset."""

from dusttaichi.compute.engine import ti


@ti.func
def distance(x, s):
    """Distance of a point on the side of the normal."""
    return x.dot(s.normal) - s.offset
