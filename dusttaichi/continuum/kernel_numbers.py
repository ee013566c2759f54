"""Arguments of the kernels that are the same in every step: made once, because Taichi is slow."""

from dataclasses import asdict

import numpy as np

from dusttaichi.continuum.kernels import smoothing
from dusttaichi.continuum.physics.kernels import material_type


class KernelNumbers:
    """Numbers of a step and of the material as kernels take them (kernels.run_arguments).

    values: of the step by name, without its length. environment: Environment, which has that.
    of_material: struct of the first material.
    """

    def __init__(self, StepNumbers, values, environment, state):
        self.values, self._environment = values, environment
        self._StepNumbers, self._passed = StepNumbers, (None, None)
        self.of_material = material_type(state.layout.laws)(**asdict(state.material))

    @property
    def of_step(self):
        """Struct of the numbers of a step: the last one where its length has not changed.

        Taichi takes a millisecond to make a struct, and searches may be as frequent as steps.
        """
        dt, (passed_dt, numbers) = self._environment.dt, self._passed
        if dt != passed_dt:
            numbers = self._StepNumbers(**self.values, output_step=dt)
            self._passed = dt, numbers
        return numbers


def numbers_of(scene):
    """Numbers of a step by name that follow from the scene alone."""
    numerics, dimension = scene.numerics, scene.dimension
    smoothing_length = numerics.smoothing_length
    stress = numerics.artificial_stress
    gravity_numbers = self_gravity(scene)
    x, y, z = (scene.gravity and scene.gravity.acceleration) or (0.0, 0.0, 0.0)
    at_spacing = smoothing.SHAPES[numerics.kernel](numerics.spacing / smoothing_length)
    printed = numerics.deviator == "printed" and dimension == 2
    return {
        "h": smoothing_length,
        "inv_h": 1.0 / smoothing_length,
        "scale": smoothing.scale(numerics.kernel, dimension, smoothing_length),
        "courant": numerics.cfl,
        "contact": numerics.viscosity.contact,
        "bulk": numerics.viscosity.bulk,
        "quadratic": numerics.viscosity.quadratic,
        "grid": numerics.viscosity.grid,
        "limiter": float(numerics.viscosity.limiter == "balsara"),
        "share": 1.0 / 2.0 if printed else 1.0 / 3.0,
        "over_return": float(numerics.plastic_return == "benz"),
        "tension": 0.0 if stress is None else stress.epsilon,
        "exponent": 1.0 if stress is None else stress.n,
        "at_spacing": 1.0 / at_spacing,
        "hourglass": numerics.hourglass,
        "longest": np.inf,
        "gravity": [x, z] if dimension == 2 else [x, y, z],
        "attraction": 0.0 if gravity_numbers is None else gravity_numbers.constant,
        "soft2": smoothing_length * smoothing_length
        if gravity_numbers is None or gravity_numbers.softening == "auto"
        else gravity_numbers.softening**2,
    }


def self_gravity(scene):
    """The block of the self-gravity of a scene, or None."""
    return scene.gravity.self_gravity if scene.gravity else None


def periods(edges, dimension):
    """Lengths of the axes of the kernels that repeat [m], and one over them; 0 of the others."""
    lengths, inverse = [0.0] * dimension, [0.0] * dimension
    for axis, low, high in edges:
        lengths[axis], inverse[axis] = high - low, 1.0 / (high - low)
    return {"period": lengths, "inv_period": inverse}
