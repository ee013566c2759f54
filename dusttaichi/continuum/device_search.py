"""The search where kernels run on a device.

The host launches its kernels and reads the outcome once. The lists are those that search.py makes
of the same places, in the same order.
"""

import numpy as np

from dusttaichi.continuum.kernels.device_lists import NOWHERE
from dusttaichi.continuum.search import Search


class DeviceSearch(Search):
    """Search by `launches` of its kernels on the device: see kernels.search.make_search."""

    def __init__(self, sim, h, mirrors, edges, rigid):
        super().__init__(sim, h, mirrors, edges, rigid)
        self.launches, images = sim.kernels.search, self.images()
        ends, planes = np.zeros((sim.dimension, 2)), np.full((sim.dimension, 2), NOWHERE)
        planes[:, 0] *= -1.0
        for axis, low, high in edges:
            ends[axis] = planes[axis] = low, high
        for axis, side, plane in mirrors:
            planes[axis, side] = plane
        sim.lists["edges"].from_numpy(ends)
        sim.lists["planes"].from_numpy(planes)
        sim.lists["found"].from_numpy([0, len(images), len(rigid)])
        sim.lists["reaches"].from_numpy([self.reach, self.near_surface])
        if images:
            sim.lists["images"].from_numpy(np.array(images).reshape(len(images), -1))
        if rigid:
            sim.lists["surfaces"].from_numpy(rigid)

    def now(self):
        self.sim.pass_numbers()
        if self.edges:
            self.launches.wrap()
        self.launches.lay_grid()
        self.launches.reorder()
        self._write_lists()
        self.count += 1

    def again(self):
        now = self.sim.of_particles("x")
        self.sim.put("x", self.sim.of_particles("x_search"))
        self.sim.pass_numbers()
        self.launches.lay_grid()
        self._write_lists()
        self.sim.put("x", now)
        if self.sim.layout.ghosts:
            self.launches.place_ghosts()

    def _write_lists(self):
        self.launches.write_lists()
        if self.launches.outcome():
            self._refuse()

    def _refuse(self):
        """Raises GuardStop with what is wrong."""
        n, lists, layout = self.sim.n, self.sim.lists, self.sim.layout
        self.check_places(self.sim.of_particles("x"))
        if layout.ghosts:
            self.check_capacity("ghost_sign", int(lists["ghost_first"].part(n, n + 1)[0]))
        self.check_capacity("entry", int(lists["first"].part(n, n + 1)[0]))
        if layout.rigid:
            self.check_capacity("touch_row", int(lists["touch_first"].part(n, n + 1)[0]))
