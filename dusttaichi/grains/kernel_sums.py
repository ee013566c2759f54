"""Sums over grains and contacts of the present state, which kernels compute. Internal units."""

import numpy as np

from dusttaichi.compute.scan import CHUNK
from dusttaichi.grains.kernels.measure import Columns
from dusttaichi.grains.kernels.store import FIRST_SPHERE, ON_SPHERE, PLANES
from dusttaichi.grains.load_sums import DeviceLoadSums, LoadSums


class KernelSums:
    """Calls the kernels that measure, and reads their sums; the state does not change.

    kernels: those of a Compiled, by name. tables: memory.Table of the sums, by name. state:
    GrainState. bodies: GrainBodies. environment: GrainEnvironment.
    """

    def __init__(self, kernels, tables, state, bodies, environment):
        self._kernels, self.tables, self._state = kernels, tables, state
        self._bodies, self._environment = bodies, environment
        self.columns = Columns(state.layout)

    def measure(self):
        """Sums over chunks of grains, (chunks, 5), and over tiles of contacts: see kernels.measure.

        The latter (tiles, columns) in a list: of pairs, walls and the sphere, whose sums
        `sphere_load` has computed; none where the scene has none.
        """
        half, bodies, state = 0.5 * self._environment.dt, self._bodies, self._state
        mass, inertia = bodies.unit_mass, bodies.unit_inertia
        step = self._environment.step
        self._kernels.measure_grains(mass, inertia, half / mass, half / inertia, step)
        self._kernels.measure_pairs(*self._environment.moment)
        # further rows may be those of a larger scene that used the kernels before
        grains = self.tables["grain_sum"].to_numpy(-(-bodies.count // CHUNK))
        contact_sums = [self._read("pair_sum", state.pair_count)]
        contact_sums += [np.zeros((0, self.columns.count))] * 2
        if self._environment.box is not None:
            self._kernels.measure_walls(*self._environment.moment)
            contact_sums[1] = self._read("wall_sum", state.wall_blocks * state.layout.width)
        if state.layout.sphere:
            contact_sums[2] = self._read("sphere_sum", int(state["counts"][ON_SPHERE]))
        return grains, contact_sums

    def sum_losses(self, contact_sums):
        """Losses by channel up to now in contacts of pairs, with walls, with the sphere, in a list.

        contact_sums: of `measure`; losses of this step are in it that belong to the time before.
        """
        state, layout = self._state, self._state.layout
        tables = [state["loss"], None, None]
        if self._environment.box is not None:
            tables[1] = state["wall_loss"]
        if layout.sphere:
            first = int(state["counts"][FIRST_SPHERE]) // layout.tile
            tables[0], tables[2] = tables[0][:first], tables[0][first:]
        return [
            np.zeros(len(layout.channels))
            if table is None
            else table.sum(axis=0) + sums[:, self.columns.pending].sum(axis=0)
            for table, sums in zip(tables, contact_sums, strict=True)
        ]

    def _read(self, name, contacts):
        """Sums over the tiles of that many contacts."""
        layout = self._state.layout
        return self.tables[name].to_numpy(-(-contacts // (layout.width * layout.tile)))

    def sphere_load(self):
        """Force [nN] and torque [nN um] of the grains on the rigid sphere now, (3,) each."""
        self._kernels.measure_sphere(*self._environment.moment)
        load = self.tables["sphere_load"].to_numpy()
        return load[:3], load[3:]

    def surface_loads(self):
        """Loads of each surface on the grains now, (S, 5), as SurfaceGatherer.load_of has them.

        Force [nN], its component along the normals, power [fJ/us].
        """
        layout, blocks = self._state.layout, self._state.wall_blocks
        self._kernels.measure_surfaces(*self._environment.moment)
        out = np.zeros((layout.surfaces, layout.impulses))
        wall_of_block = self._state.fields["wall_of"].to_numpy(blocks)
        np.add.at(out, wall_of_block, self.tables["surface_load"].to_numpy(blocks))
        return out[PLANES:]

    def surface_power(self):
        """Power of all surfaces now [fJ/us]; 0 without any."""
        return float(self.surface_loads()[:, 4].sum()) if self._state.layout.curved else 0.0

    def read_loads(self):
        """The LoadSums now."""
        arguments = self._state, self._environment, self._bodies.unit_mass
        if not hasattr(self._kernels, "load_sums"):
            return LoadSums(*arguments)
        self._kernels.load_sums()
        return DeviceLoadSums(*arguments, sums=self.tables["load_sums"].to_numpy())

    def grain_losses(self):
        """Energy lost in the contacts of each grain since the start [fJ], (N, channels).

        Grains are in the sample's order. Two grains share the loss; at a wall or the sphere it is
        the grain's.
        """
        self._kernels.add_grain_losses()
        out = np.empty((self._bodies.count, len(self._state.layout.channels)))
        out[self._state.order] = self._state["grain_loss"]
        return out
