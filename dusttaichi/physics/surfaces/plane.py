"""A plane: x.normal = offset."""

from dusttaichi.physics.forces.force_numbers import Number

NUMBERS = {"normal": Number("1", 3), "offset": Number("m")}


def numbers(block):
    """Unit normal of the block, and its product with a point of the plane."""
    size = sum(a * a for a in block.normal) ** 0.5
    normal = [a / size for a in block.normal]
    return {
        "normal": normal,
        "offset": sum(a * b for a, b in zip(normal, block.point, strict=True)),
    }


def distance(x, s):
    """Distance of a point on the side of the normal."""
    return x[0] * s.normal[0] + x[1] * s.normal[1] + x[2] * s.normal[2] - s.offset


def normal(x, s):
    """The same everywhere."""
    return s.normal[0], s.normal[1], s.normal[2]
