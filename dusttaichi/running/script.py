"""Changes of a simulation by a script between steps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dusttaichi.errors import DustError
from dusttaichi.running.present_state import PresentState

if TYPE_CHECKING:
    from dusttaichi.scene.scene import Scene


class ScriptControl(PresentState):
    """Forces and velocities of a running simulation, for `Simulation` to inherit."""

    scene: Scene

    def set_forces(self, forces: ArrayLike) -> None:
        """Set the force on every grain from now on, beside all others.

        Its work is in `force_work`. It needs `forces: [{kind: script}]` in the scene.

        Parameters
        ----------
        forces : array
            [N], (grains, 3), or (3,) for all of them.

        Raises
        ------
        DustError
            The scene has no such force, or the numbers are not finite or not of that shape.
        """
        self._change("set_forces", forces)

    def set_velocities(
        self, velocities: ArrayLike | None = None, spins: ArrayLike | None = None
    ) -> None:
        """Set velocities and angular velocities; the change of their energy is in `force_work`.

        It needs `forces: [{kind: script}]` in the scene.

        Parameters
        ----------
        velocities : array, optional
            [m/s], (grains, 3), or (3,) for all of them.
        spins : array, optional
            [rad/s], likewise.

        Raises
        ------
        DustError
            The scene has no such force, or the numbers are not finite or not of that shape.
        """
        self._change("set_velocities", velocities, spins)

    def _change(self, name: str, *values: Any) -> None:
        if not any(force.kind == "script" for force in getattr(self.scene, "forces", ())):
            raise DustError(
                f"{name}: its work needs a place in the ledger; add {{kind: script}} to `forces` "
                "of the scene"
            )
        sim = self._run.sim
        if not hasattr(sim, name):
            raise DustError(f"{name}: allowed with method: grains")
        getattr(sim, name)(*(self._vectors(name, value, sim.size) for value in values))

    @staticmethod
    def _vectors(name: str, value: ArrayLike | None, size: int) -> NDArray[np.float64] | None:
        if value is None:
            return None
        array = np.asarray(value, float)
        if array.shape not in ((3,), (size, 3)) or not np.isfinite(array).all():
            raise DustError(
                f"{name}: finite numbers of the shape ({size}, 3) or (3,) are needed, not "
                f"{array.shape}"
            )
        return np.broadcast_to(array, (size, 3))
