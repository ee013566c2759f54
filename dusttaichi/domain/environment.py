"""Environment of the particles at the present step, a part of every engine."""

from dataclasses import replace


class Environment:
    """Walls and cell around the particles, which move with the steps, in units of the Domain.

    step: whole steps done. domain: the Domain, with the speeds of the moment.
    """

    def __init__(self, domain):
        self.step = 0
        self.place(domain)

    @property
    def units(self):
        return self.domain.units

    @property
    def dt(self):
        """Time step."""
        return self.domain.dt

    @dt.setter
    def dt(self, value):
        self.domain = replace(self.domain, dt=value)

    @property
    def time(self):
        """Time of the positions."""
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

    def lengths(self):
        """Current edges of the space for the particles, (3,); not a number where it is open."""
        return self.domain.lengths(self.step)

    def place(self, domain):
        """Take walls and cell with their speeds from this Domain."""
        self.domain = domain
