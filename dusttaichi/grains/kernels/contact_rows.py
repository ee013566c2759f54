"""The rows of a contact in the fields of a scene: its history, its loads."""

from dusttaichi.compute.engine import ti
from dusttaichi.grains.kernels.store import OPPOSITE


def _masks(law):
    """True if a law masks its history of contacts that did not touch before."""
    return getattr(law, "MASKED", False)


@ti.data_oriented
class Rows:
    """Rows of the fields of contacts: history and loads."""

    def __init__(self, fields, layout):
        self.table, self.load, self.dtype = fields["contact"], fields["load"], layout.law
        self.opposite = layout.opposite
        self.vec3 = ti.types.vector(3, layout.law)
        named = [(name, *layout.rows[name]) for name in layout.model.history]
        self.scalars = tuple((name, first) for name, first, width in named if width == 1)
        self.vectors = tuple((name, first) for name, first, width in named if width == 3)
        masked = [*layout.model.radial, *(n for n in layout.model.springs if _masks(n))]
        names = {name for law in masked for name in law.HISTORY}
        self.unmasked = (*names, "touched")  # not masked: their effects do that
        members = dict.fromkeys((name for name, _ in self.scalars), self.dtype)
        members |= dict.fromkeys((name for name, _ in self.vectors), self.vec3)
        self.History = ti.types.struct(**members)
        self.touched = layout.rows["touched"][0]
        self.history_rows = layout.history_rows
        self.lost = layout.rows.get("lost", (-1, 0))[0]
        self.recent = layout.rows.get("recent", (-1, 0))[0]

    @ti.func
    def vector(self, b, first: ti.template(), lane):
        t = ti.static(self.table)
        return self.vec3(t[b, first, lane], t[b, first + 1, lane], t[b, first + 2, lane])

    @ti.func
    def put_vector(self, b, first: ti.template(), lane, a):
        for c in ti.static(range(3)):
            self.table[b, first + c, lane] = a[c]

    @ti.func
    def add(self, b, row: ti.template(), lane, value):
        self.table[b, row, lane] = self.table[b, row, lane] + value

    @ti.func
    def history(self, b, lane):
        """History of a contact."""
        return self.History(
            *[self.table[b, first, lane] for _, first in self.scalars],
            *[self.vector(b, first, lane) for _, first in self.vectors],
        )

    @ti.func
    def write(self, block, lane, history: ti.template(), touched_before):
        """Write the history, that of springs times `touched_before`, 1 or 0."""
        for name, first in ti.static(self.scalars):
            value = history.__getitem__(name)
            if ti.static(name not in self.unmasked):
                value = value * touched_before
            self.table[block, first, lane] = value
        for name, first in ti.static(self.vectors):
            vector = history.__getitem__(name)
            if ti.static(name not in self.unmasked):
                vector = vector * touched_before
            self.put_vector(block, first, lane, vector)

    @ti.func
    def force(self, b, lane):
        """Force on the first body of a contact."""
        t = ti.static(self.load)
        return self.vec3(t[b, 0, lane], t[b, 1, lane], t[b, 2, lane])

    @ti.func
    def put_force(self, b, lane, force):
        """Put the force on the first body, and on the second where it has rows of its own."""
        for c in ti.static(range(3)):
            self.load[b, c, lane] = force[c]
            if ti.static(self.opposite):
                self.load[b, OPPOSITE + c, lane] = -force[c]

    @ti.func
    def put_loads(self, b, lane, load: ti.template()):
        """Force and torque on the first body, torque on the second: the force on it is opposite."""
        self.put_force(b, lane, load.force)
        for c in ti.static(range(3)):
            self.load[b, 3 + c, lane] = load.torque_1[c]
            self.load[b, 6 + c, lane] = load.torque_2[c]
