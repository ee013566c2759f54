"""State of a continuum: the used part of its fields, and the order of its particles. SI inside."""

from contextlib import contextmanager
from functools import partial

import numpy as np

from dusttaichi.compute.host_threads import cut_rows, share_out
from dusttaichi.compute.memory import FieldState, view_cells
from dusttaichi.continuum.kernels.store import COLUMN, FACES, OLD, SUBSTEPS, WHOLE, declare
from dusttaichi.method import ArraysOnRequest

ROWS_AT_ONCE = 2**13  # particles that a thread puts in another order


class DustState(FieldState):
    """The state of a scene of `count` particles, in internal order.

    fields: memory.Table by name, see kernels.store. bodies: number of rigid bodies. materials:
    MaterialNumbers of all materials; material: of the first. dimension: 2 or 3; axes: those of the
    kernels among x, y, z. names: of the variables of a particle.
    """

    def __init__(self, fields, layout, *, count, bodies, materials):
        super().__init__(fields, layout)
        self.count, self.bodies = count, bodies
        self.materials, self.material = materials, materials.take(0)
        self.dimension = layout.dimension
        self.axes = [0, 2] if self.dimension == 2 else [0, 1, 2]
        variables = declare(layout)
        self.names = [variable.name for variable in variables]
        self._adjacent = {}  # names by their block of memory
        for variable in variables:
            self._adjacent.setdefault(variable.place, []).append(variable.name)
        self._rows = None  # of bodies and clock, while nothing moves

    @contextmanager
    def at_rest(self):
        """Context in which nothing moves: rows of bodies and clock are read once."""
        if self._rows is not None:
            yield
            return
        self._rows = {}
        try:
            yield
        finally:
            self._rows = None

    def _read(self, name, rows):
        if self._rows is None:
            return self.fields[name].to_numpy(rows)
        if name not in self._rows:
            self._rows[name] = self.fields[name].to_numpy(rows)
        return self._rows[name]

    def of_particles(self, name, first=0, end=None):
        """A copy of a variable of all particles, or of those from `first` to before `end`."""
        return self.fields[name].copy_rows(first, self.count if end is None else end)

    def material_of(self, which=slice(None)):
        """MaterialNumbers of particles in internal order, of one where there is one alone."""
        if not self.layout.materials:
            return self.material
        return self.materials.take(self.of_particles("material")[which])

    def of_bodies(self, name):
        """A Column of the faces and rigid bodies by its name, (FACES + bodies, width)."""
        if self._rows is None:
            return self.fields["rigid"].to_numpy(FACES + self.bodies, COLUMN[name])
        return self._read("rigid", FACES + self.bodies)[:, COLUMN[name]].copy()

    @property
    def clock(self):
        """Lengths of the time steps of the method, see kernels.store."""
        return self._read("clock", None).copy()

    @property
    def half_step(self):
        """Half of the last time step [s]: velocities in memory are as far behind positions."""
        return 0.5 * self.clock[OLD]

    @property
    def substeps(self):
        """Time steps so far."""
        return int(self.clock[SUBSTEPS])

    # -- orders and axes -------------------------------------------------------------------------

    def reorder(self, order, threads=1):
        """Put the particles in another order."""
        for names in self._adjacent.values():
            cells = view_cells([self.fields[name] for name in names], self.count)
            if cells is None:
                for name in names:
                    self[name] = self.of_particles(name)[order]
                continue
            _reorder(cells, order, threads)  # all variables of a block at once

    def in_order(self, values):
        """Rows of all particles in the order of the sample, of those in internal order."""
        out = np.empty_like(values)
        out[self.of_particles("number")] = values
        return out

    def raise_to_space(self, values):
        """Vectors of the kernels (n, dimension) as (n, 3)."""
        out = np.zeros((len(values), 3))
        out[:, self.axes] = values
        return out

    # -- checkpoint ------------------------------------------------------------------------------

    def arrays(self):
        """All state, for a checkpoint: an array is copied as it is read."""
        functions = {name: partial(self.of_particles, name) for name in self.names}
        return ArraysOnRequest(
            functions | {name: partial(self.__getitem__, name) for name in WHOLE}
        )

    def restore(self, arrays):
        """Go back to the arrays of a checkpoint of the same scene and sample."""
        for name in (*self.names, *WHOLE):
            self[name] = arrays[name]


def _reorder(rows, order, threads):
    """Put rows (n,) in another order, in several threads."""
    reordered, slices = np.empty_like(rows), cut_rows(len(rows), ROWS_AT_ONCE)

    def gather(part):
        reordered[part] = rows[order[part]]

    def put(part):
        rows[part] = reordered[part]

    share_out(gather, slices, threads)
    share_out(put, slices, threads)
