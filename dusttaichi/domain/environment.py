"""Environment of the particles at the present step, a part of every engine."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from dusttaichi.domain.cell import Cell
    from dusttaichi.domain.domain import Domain
    from dusttaichi.domain.servo import Servo
    from dusttaichi.domain.walls import Box
    from dusttaichi.units import Units


class Environment:
    """Walls and cell around the particles, which move with the steps, in units of the Domain.

    step: whole steps done. domain: the Domain, with the speeds of the moment.
    """

    domain: Domain

    def __init__(self, domain: Domain) -> None:
        self.step = 0
        self.place(domain)

    @property
    def units(self) -> Units:
        return self.domain.units

    @property
    def dt(self) -> float:
        """Time step."""
        return self.domain.dt

    @dt.setter
    def dt(self, value: float) -> None:
        self.domain = replace(self.domain, dt=value)

    @property
    def time(self) -> float:
        """Time of the positions."""
        return self.step * self.domain.dt

    @property
    def box(self) -> Box | None:
        """Walls, a Box, or None."""
        return self.domain.box

    @property
    def cell(self) -> Cell | None:
        """The periodic Cell, or None."""
        return self.domain.cell

    @property
    def servo(self) -> Servo | None:
        """Servo that controls a load, or None."""
        return self.domain.servo

    def lengths(self) -> NDArray[np.float64]:
        """Current edges of the space for the particles, (3,); not a number where it is open."""
        return self.domain.lengths(self.step)

    def place(self, domain: Domain) -> None:
        """Take walls and cell with their speeds from this Domain."""
        self.domain = domain
