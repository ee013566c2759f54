"""Sums over grains and contacts for the loads on walls and faces."""

import numpy as np

from dusttaichi.grains.kernels.load_sums import COLUMNS, ON_WALLS
from dusttaichi.grains.kernels.store import FIRST_WALL, PLANES


class LoadSums:
    """The sums of a GrainState as it is now, each computed where it is needed.

    They are added up here, which takes less time than a kernel. Not valid after a step.
    environment: Environment. unit_mass: of GrainBodies.
    """

    def __init__(self, state, environment, unit_mass):
        self.state, self.fields, self.layout = state, state.fields, state.layout
        self.box, self.unit_mass = environment.box, unit_mass

    def wall_force(self):
        """Force of each wall on the grains [nN], (6, 3), summed in the order of the lanes."""
        if self.box is None:
            return np.zeros((6, 3))
        first, walls = int(self.state["counts"][FIRST_WALL]), self.state.walls_of_lanes()
        load = self.fields["load"].copy_rows(first, first + self.state.wall_blocks, slice(0, 3))
        along = (np.bincount(walls, load[:, n].ravel(), minlength=6)[:6] for n in range(3))
        return np.stack(list(along), axis=1)

    def impulses(self):
        """Time integral of the wall forces since the start [nN us], (6, 3)."""
        return np.zeros((6, 3)) if self.box is None else self._sum_impulses()[:PLANES, :3]

    def surface_impulses(self):
        """Time integral of KernelSums.surface_loads since the start, (S, 5)."""
        return self._sum_impulses()[PLANES:]

    def _sum_impulses(self):
        """Time integrals of all walls, the surfaces among them."""
        total, blocks = self.state["impulse_total"], self.state.wall_blocks
        wall_of_block = self.fields["wall_of"].to_numpy(blocks)
        np.add.at(total, wall_of_block, self.fields["impulse"].to_numpy(blocks))
        return total

    def across_faces(self):
        """Sum over the pairs of their force times the periodic edges between them [nN], (3, 3).

        Its product with the speeds of the edges is the power of the faces.
        """
        out, blocks = np.zeros((3, 3)), -(-self.state.pair_count // self.layout.width)
        force = self.fields["load"].to_numpy(blocks, slice(0, 3)).astype(float)
        shift = self.fields["shift"].to_numpy(blocks).astype(float)
        out[:, list(self.layout.periodic)] = np.einsum("bfk,bak->fa", force, shift)
        return out

    def column_sums(self, name):
        """Sums of the columns of a field of stresses."""
        return self.fields[name].to_numpy().sum(axis=0)

    def momentum_flux(self):
        """Time integral of the momentum flux since the start [fJ us], (3, 3).

        The sum of m v_a v_b and of branch_a force_b over all contacts: minus volume times stress
        (T19 eq 23).
        """
        xx, xy, xz, yy, yz, zz = self.column_sums("flux")
        total = self.unit_mass * np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        for name in ("virial", "wall_virial"):
            if name in self.state:
                total += self.column_sums(name).reshape(3, 3)
        return total


class DeviceLoadSums(LoadSums):
    """LoadSums formed by a device and read by the host in one transfer, `sums`."""

    def __init__(self, *arguments, sums):
        super().__init__(*arguments)
        self.sums = sums
        self.on_walls = sums[ON_WALLS:].reshape(-1, 3 + self.layout.impulses)

    def wall_force(self):
        return self.on_walls[:6, :3]

    def _sum_impulses(self):
        return self.on_walls[:, 3:]

    def across_faces(self):
        return self.column_sums("across").reshape(3, 3)

    def column_sums(self, name):
        return self.sums[COLUMNS[name]]
