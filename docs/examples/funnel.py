"""A surface of your own: a funnel that opens upwards with a half angle a, z sin a = rho cos a."""

from math import cos, sin
from typing import Annotated, Literal

from pydantic import Field

from dusttaichi.scene.quantities import Quantity
from dusttaichi.scene.surfaces import Number, Surface, register


class Funnel(Surface):
    kind: Literal["funnel"]
    half_angle: Annotated[float, Quantity("angle", gt=0)] = Field(description="from the axis")


class Cone:
    NUMBERS = {"sine": Number("1"), "cosine": Number("1")}

    def numbers(block):
        return {"sine": sin(block.half_angle), "cosine": cos(block.half_angle)}

    def distance(x, s):
        return x[2] * s.sine - (x[0] ** 2 + x[1] ** 2) ** 0.5 * s.cosine

    def normal(x, s):
        inwards = -s.cosine / (x[0] ** 2 + x[1] ** 2 + 1e-18) ** 0.5
        return inwards * x[0], inwards * x[1], s.sine


register(Funnel, Cone)
