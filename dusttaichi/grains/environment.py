"""Environment of the grains at the present step: walls and periodic cell. Internal units."""

from dataclasses import replace

from dusttaichi.grains.step import walls_argument


class Environment:
    """Walls and cell around the grains, which move with the steps.

    step: whole steps done. domain: the Domain, with the speeds of the moment. state: GrainState, in
    whose fields the kernels read the cell.
    """

    def __init__(self, state, domain):
        self._state, self.step = state, 0
        self.place(domain)

    @property
    def dt(self):
        """Time step [us]."""
        return self.domain.dt

    @dt.setter
    def dt(self, value):
        self.domain = replace(self.domain, dt=value)

    @property
    def time(self):
        """Time of the positions [us]."""
        return self.step * self.domain.dt

    @property
    def box(self):
        """Walls, a Box, or None."""
        return self.domain.box

    @property
    def cell(self):
        """The periodic Cell, or None."""
        return self.domain.cell

    @property
    def servo(self):
        """Servo that controls a load, or None."""
        return self.domain.servo

    @property
    def walls_argument(self):
        """The walls as kernels take them."""
        return walls_argument(self.domain.box)

    @property
    def moment(self):
        """(step, dt, walls): arguments of the kernels that measure the present state."""
        return self.step, self.domain.dt, self.walls_argument

    def lengths(self):
        """Current edges of the space for the grains [um], (3,); not a number where it is open."""
        return self.domain.lengths(self.step)

    def place(self, domain):
        """Take walls and cell with their speeds from this Domain."""
        self.domain = domain
        if domain.cell is not None:
            self._state["cell"] = domain.cell.rows

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
