"""Gravity in internal units: accelerations and potential."""

from dataclasses import dataclass

import numpy as np

from dusttaichi import units

NEAREST2 = 1e-12  # square of the distance below which a centre does not attract [um^2]


@dataclass(frozen=True, eq=False)
class Gravity:
    """kind: constant or central. numbers (6,): of the field `gravity` (grains.kernels.grains)."""

    kind: str
    numbers: np.ndarray

    def acceleration(self, x):
        """Accelerations [um/us^2], (n, 3), at the positions x [um], (n, 3)."""
        if self.kind == "constant":
            return np.broadcast_to(self.numbers[:3], x.shape)
        towards = self.numbers[:3] - x
        square = np.maximum(np.sum(towards**2, axis=1, keepdims=True), NEAREST2)
        return self.numbers[3] * square ** (0.5 * (self.numbers[4] - 1.0)) * towards

    def potential(self, x):
        """Potential energy per mass [um^2/us^2], (n,), at the positions x [um], (n, 3)."""
        if self.kind == "constant":
            return -(x @ self.numbers[:3])
        strength, power = self.numbers[3], self.numbers[4] + 1.0
        distance = np.sqrt(np.maximum(np.sum((x - self.numbers[:3]) ** 2, axis=1), NEAREST2))
        return strength * (np.log(distance) if power == 0.0 else distance**power / power)


def make_gravity(block):
    """Gravity of the scene's block `gravity`, None without."""
    if block is None:
        return None
    numbers = np.zeros(6)
    if block.kind == "constant":
        numbers[:3] = np.array(block.acceleration) / units.ACCELERATION
    else:
        central = block.central
        numbers[:3] = np.array(central.centre) / units.LENGTH
        # g = k d^n: both in SI, then with d in um
        numbers[3] = central.strength * units.LENGTH**central.exponent / units.ACCELERATION
        numbers[4] = central.exponent
    return Gravity(block.kind, numbers)
