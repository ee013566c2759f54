"""Readings of the present state of a simulation, in SI."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.errors import DustError
from dusttaichi.running.activities import series_record, take_records
from dusttaichi.running.present import label_values, read_only

if TYPE_CHECKING:
    from dusttaichi.running.loop import Run
    from dusttaichi.running.present import PresentValues


class PresentState(AbstractContextManager["PresentState"]):
    """The state of a running simulation between two steps, for `Simulation` to inherit."""

    _run: Run

    @property
    def step(self) -> int:
        """Whole steps done."""
        return self._run.sim.step

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._run.sim.time * self._run.sim.units("s")

    @property
    def time_step(self) -> float:
        """The step [s]."""
        return self._run.sim.dt * self._run.sim.units("s")

    def measure(self) -> PresentValues:
        """Present values of the time series of result.nc, in SI, by the same names.

        `units` has their units. Arrays are read-only xarray.DataArray, as pressure.sel(wall="top").
        Averages (pressure, wall_force, stress) are over the time since the last record, or, at the
        step of a record, over its time. The state does not change.
        """
        run, sim = self._run, self._run.sim
        window = run.state.window(sim)
        return label_values(sim, series_record(sim, run.clock, run.state, sim.measure(), window))

    def snapshot(self) -> dict[str, dict[str, NDArray[Any]]]:
        """The current frame: group of result.nc (snapshots, ...) -> name -> array [SI].

        This and all other arrays of the state are read-only copies: nothing that is written into
        them would change the simulation. A changed sample does.
        """
        return {
            group: {name: read_only(values) for name, values in record.items()}
            for group, record in take_records(self._run.sim, "snapshots")
        }

    @property
    def positions(self) -> NDArray[np.float64]:
        """Positions of the grains [m], (grains, 3)."""
        return self.snapshot()["snapshots"]["position"]

    @property
    def velocities(self) -> NDArray[np.float64]:
        """Velocities [m/s], (grains, 3), at the same time."""
        return self.snapshot()["snapshots"]["velocity"]

    @property
    def spins(self) -> NDArray[np.float64]:
        """Angular velocities [rad/s], (grains, 3)."""
        return self.snapshot()["snapshots"]["spin"]

    @property
    def contacts(self) -> dict[str, NDArray[Any]]:
        """Contacts between grains: name -> array, one row a contact, as in /contacts of result.nc.

        Names are for example grain_i, grain_j, overlap [m]. Needs `output.contacts: true`, the
        default.
        """
        groups = self.snapshot()
        if "contacts" not in groups:
            raise DustError("output.contacts = false: contacts are not recorded; allowed: true")
        return groups["contacts"]

    def forces(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Force and torque of the contacts on every grain.

        They are evaluated from the current positions, velocities and histories, without a step.

        Returns
        -------
        force
            [N], (grains, 3).
        torque
            [N m], (grains, 3).

        Raises
        ------
        DustError
            The method has no forces.
        """
        if not hasattr(self._run.sim, "forces"):
            raise DustError("forces are known of grains; this scene is of another method")
        force, torque = self._run.sim.forces()
        return read_only(force), read_only(torque)
