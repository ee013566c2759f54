"""Environment of the grains at the present step: walls and periodic cell. Internal units."""

from dataclasses import replace
from functools import lru_cache

from dusttaichi.domain.environment import Environment
from dusttaichi.grains.kernels.gather import Walls


class GrainEnvironment(Environment):
    """Walls and cell around the grains, as the kernels read them.

    state: GrainState, in whose fields the kernels read the cell. walls_argument: the walls as
    kernels take them.
    """

    def __init__(self, state, domain):
        self._state = state
        super().__init__(domain)

    @property
    def moment(self):
        """(step, dt, walls): arguments of the kernels that measure the present state."""
        return self.step, self.domain.dt, self.walls_argument

    def place(self, domain):
        """Take walls and cell with their speeds from this Domain."""
        super().place(domain)
        self.walls_argument = make_walls_argument(domain.box)
        if domain.cell is not None:
            self._state["cell"] = domain.cell.rows
        if domain.surfaces is not None:
            self._state["surfaces"] = domain.surfaces.table

    def set_upright(self, time):
        """Continue a cell tilted by more than half its edge as the same lattice, tilted less.

        A search must follow.
        """
        cell = self.cell.upright(time)
        if cell is not self.cell:
            self.place(replace(self.domain, cell=cell))

    def closing_speed(self):
        """Speed at which faces may bring grains together, now or allowed by a servo [um/us]."""
        return self.domain.closing_speed(self.step)


def make_walls_argument(box):
    """The walls of a Box, or of None, as kernels take them."""
    if box is None:
        return _make_no_walls()
    return Walls(
        normal=box.normal.tolist(),
        offset=box.offset.tolist(),
        speed=box.speed.tolist(),
        strength=box.strength.tolist(),
        along=box.along[:, 0].tolist(),
    )


@lru_cache(1)  # which takes as long as a step of ten thousand grains
def _make_no_walls():
    return Walls()
