"""Compressive strength of dust after Tatsuuma et al. (2023): E_roll/r^3 (1/phi - 1/phi_max)^-3.

E_roll is the energy to roll a grain by 90 degrees.
"""

from typing import Annotated

from pydantic import Field

from dusttaichi.continuum.physics import register
from dusttaichi.continuum.scene import DustLaw
from dusttaichi.physics.contact.effect_numbers import Constant
from dusttaichi.physics.laws import rolling_energy
from dusttaichi.scene.quantities import Quantity


class Keys(DustLaw):
    radius: Annotated[float, Quantity("length", gt=0)] = Field(description="radius of a grain")
    surface_energy: Annotated[float, Quantity("surface energy", gt=0)]
    critical_rolling: Annotated[float, Quantity("length", gt=0)]
    phi_max: float = Field(0.74, gt=0, le=1, description="filling factor of the densest packing")


class RollingGrains:
    NUMBERS = {"scale": Constant("Pa", "E_roll/r^3")}

    def numbers(material, keys):
        energy = rolling_energy(keys.surface_energy, keys.radius, keys.critical_rolling)
        return {"scale": energy / keys.radius**3}

    def limits(keys):
        return 0.0, keys.phi_max

    def strength(phi, m):
        return m.scale * (1.0 / phi - 1.0 / m.phi_2) ** -3.0


register("compressive", "rolling_grains", RollingGrains, Keys)
