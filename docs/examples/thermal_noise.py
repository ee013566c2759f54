"""A force of your own: thermal noise of a gas at rest with its drag (Langevin), -v/tau + noise."""

from typing import Annotated, Literal

from pydantic import Field

from dusttaichi import ti
from dusttaichi.physics.forces.random import normal_vector
from dusttaichi.scene.forces import Force, Number, register
from dusttaichi.scene.quantities import Quantity

BOLTZMANN = 1.380649e-23  # J/K


class ThermalNoise(Force):
    kind: Literal["thermal_noise"]
    stopping_time: Annotated[float, Quantity("time", gt=0)] = Field(description="tau")
    temperature: Annotated[float, Quantity("temperature", gt=0)] = Field(description="of the gas")
    seed: int = Field(1, description="seed of the noise")


class Langevin:
    NUMBERS = {"rate": Number("s^-1"), "energy": Number("J"), "seed": Number("1")}
    CHANNEL = "thermal"

    @staticmethod
    def numbers(block):
        energy = BOLTZMANN * block.temperature
        return {"rate": 1.0 / block.stopping_time, "energy": energy, "seed": block.seed}

    @staticmethod
    def timescale(block, particles):
        return block.stopping_time

    @staticmethod
    @ti.func
    def acceleration(constants, particle):
        size = ti.sqrt(2.0 * constants.energy * constants.rate / (particle.mass * particle.dt))
        noise = size * normal_vector(constants.seed, particle.number, particle.step)
        return noise - constants.rate * particle.velocity


register(ThermalNoise, Langevin)
