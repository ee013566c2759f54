"""Motion of the grains at the present step: loads, velocities, positions. Internal units.

Velocities and spins in memory are half a step behind the positions. (N, ...) arrays are in internal
order unless said otherwise.
"""

from dataclasses import dataclass

import numpy as np

from dusttaichi.grains.bodies import GrainBodies
from dusttaichi.grains.grain_environment import GrainEnvironment
from dusttaichi.grains.kernels.list_entries import decode_entries
from dusttaichi.grains.outside_forces import ActingForces
from dusttaichi.grains.pushes import Push
from dusttaichi.grains.state import GrainState
from dusttaichi.grains.wall_geometry import distances_to, list_present


@dataclass(frozen=True, eq=False)
class Motion:
    """Motion of the grains of a GrainState under contacts, forces from outside and pushes."""

    state: GrainState
    bodies: GrainBodies
    environment: GrainEnvironment
    push: Push
    outside: ActingForces | None

    # -- loads -----------------------------------------------------------------------------------

    def sum_contact_loads(self):
        """Force [nN] and torque [nN um] of the contacts alone on every grain, (2, N, 3)."""
        state, count = self.state, self.bodies.count
        grain, contact, is_second = _list_contacts(state)
        load = state.fields["load"]
        blocks = int(contact.max(initial=-1)) // state.layout.width + 1
        out = np.empty((2, count, 3))

        def read(column):
            return load.to_numpy(blocks, slice(column, column + 1)).reshape(-1)

        # one column after another, which takes little memory
        for axis in range(3):
            force = read(axis)[contact]
            np.negative(force, out=force, where=is_second)
            out[0, :, axis] = np.bincount(grain, force, count)
            torque = read(3 + axis)[contact]
            torque[is_second] = read(6 + axis)[contact[is_second]]
            out[1, :, axis] = np.bincount(grain, torque, count)
        return out

    def sum_loads(self, present=False):
        """Force [nN] and torque [nN um] that move every grain, (2, N, 3).

        present: velocities and spins in memory are those of the positions, not half a step back.
        """
        loads, count = self.sum_contact_loads(), self.bodies.count
        if self.outside is not None:
            linear, angular = self.outside.accelerations(present)
            loads[0] += self.bodies.mass * linear[:count]
            loads[1] += self.bodies.inertia * angular[:count]
        return self.push.add_to(loads, self.environment.step) if self.push.works else loads

    def half_kicks(self, present=False):
        """Changes of velocity and of spin in half a step by the current loads, (N, 3) each.

        present: see `sum_loads`.
        """
        (force, torque), half = self.sum_loads(present), 0.5 * self.environment.dt
        return half / self.bodies.mass * force, half / self.bodies.inertia * torque

    # -- velocities ------------------------------------------------------------------------------

    def velocities(self):
        """Velocities [um/us] and spins [rad/us] now, (N, 3) each."""
        kick, turn = self.half_kicks()
        return self.state.of_grains("v") + kick, self.state.of_grains("w") + turn

    def set_back(self, v, w):
        """Put current velocities and spins into memory."""
        if self.outside is not None:  # which may depend on them
            self.state["v"], self.state["w"] = v, w
        kick, turn = self.half_kicks(present=True)
        self.state["v"], self.state["w"] = v - kick, w - turn

    def kinetic_energy(self, v, w):
        """Kinetic energy of all grains [fJ] with these velocities and spins."""
        return 0.5 * float(np.sum(self.bodies.mass * v**2) + np.sum(self.bodies.inertia * w**2))

    def kinetic_energy_of_images(self):
        """Change of the kinetic energy where grains outside a moving cell are at their images [fJ].

        Grains that have left the cell since the last search are taken at their images inside, as in
        snapshots.
        """
        cell, time = self.environment.cell, self.environment.time
        if not cell.speeds(time).any() and not cell.tilt_rate:
            return 0.0
        # positions and velocities of the followed images
        x, (v, _) = self.state.of_grains("x"), self.velocities()
        shift = cell.speeds_across(cell.outside(x, time), time)
        return float(np.sum(0.5 * self.bodies.mass * (shift - 2.0 * v) * shift))

    # -- in the sample's order -------------------------------------------------------------------

    def measure(self):
        """Positions [um], velocities [um/us], spins [rad/us] now, (3, N, 3), in the sample's order.

        In a cell those of the image inside, which moves with the edges.
        """
        x, (v, w) = self.state.of_grains("x"), self.velocities()
        cell, time = self.environment.cell, self.environment.time
        if cell is not None:
            crossed = cell.outside(x, time)
            x, v = x - cell.across(crossed, time), v - cell.speeds_across(crossed, time)
        out = np.empty((3, self.bodies.count, 3))
        for row, values in zip(out, (x, v, w), strict=True):
            values.take(self.state.rank, axis=0, out=row, mode="clip")
        return out

    def measure_positions(self):
        """Positions of the grains [um], (N, 3), as `measure` has them."""
        x = self.state.of_grains("x")
        cell, time = self.environment.cell, self.environment.time
        if cell is not None:
            x = x - cell.across(cell.outside(x, time), time)
        return x.take(self.state.rank, axis=0)

    def masses_and_inertias(self):
        """Masses [pg] and moments of inertia [pg um^2], (N, 1) each, in the sample's order."""
        rank, count = self.state.rank, self.bodies.count
        return (
            np.broadcast_to(values[rank] if np.ndim(values) else values, (count, 1))
            for values in (self.bodies.mass, self.bodies.inertia)
        )

    def find_nearest_to_walls(self):
        """(distance [um], grain, wall) of the centre nearest to its wall or farthest beyond it.

        The grain is that of the sample; distances are negative beyond the wall.
        """
        domain, x = self.environment.domain, self.state.of_grains("x")
        nearest, time = (np.inf, -1, -1), self.environment.time
        for wall in np.flatnonzero(list_present(domain)):
            distance = distances_to(domain, wall, x, time)
            grain = int(np.argmin(distance))
            number = int(self.state.order[grain])
            nearest = min(nearest, (float(distance[grain]), number, int(wall)))
        return nearest


def _list_contacts(state):
    """Grain, number of the contact, whether the grain is its second body, of all listed contacts.

    Those of a grain in the order in which its loads are summed (kernels.grain_pass).
    """
    start = state["entry_start"]
    entry = state["entry"][: start[-1]]
    grain, listed = np.repeat(np.arange(len(start) - 1), np.diff(start)), entry >= 0
    return grain[listed], *decode_entries(entry[listed], state.layout.width)
