"""Self-gravity: every particle attracts every other one, summed directly in a fixed order.

Positions and masses are copied into separate arrays, one axis after another, so that the loop over
all particles reads whole vectors.
"""

from dusttaichi.compute.engine import ti
from dusttaichi.continuum.physics.kernels import LAWS
from dusttaichi.results.roles import RIGID, WALL


@ti.data_oriented
class Attraction:
    """fields, lists: see store.place; dimension: 2 or 3."""

    def __init__(self, fields, lists, dimension):
        self.f, self.lists, self.n = fields, lists, dimension
        self.law = LAWS.cylinder_pull if dimension == 2 else LAWS.sphere_pull
        self.energy = LAWS.cylinder_potential if dimension == 2 else LAWS.sphere_potential

    @ti.func
    def note(self, i):
        """Write the position and the mass of particle i."""
        role = self.f.role[i]
        for a in ti.static(range(self.n)):
            self.lists.places[a, i] = self.f.x[i][a]
        heavy = role != RIGID and role != WALL
        self.lists.weights[i] = ti.select(heavy, self.f.mass[i], 0.0)

    @ti.func
    def pull(self, i, numbers: ti.template()):
        """Acceleration of particle i by all others [m/s^2]."""
        x, out = self.f.x[i], ti.Vector.zero(ti.f64, self.n)
        for j in range(numbers.count):
            d = ti.Vector([self.lists.places[a, j] - x[a] for a in ti.static(range(self.n))])
            out += self.lists.weights[j] * self.law(d.norm_sqr(), numbers.soft2) * d
        return numbers.attraction * out

    @ti.func
    def potential(self, i, numbers: ti.template()):
        """Potential at particle i of all others [m^2/s^2]."""
        x, out = self.f.x[i], 0.0
        for j in range(numbers.count):
            d = ti.Vector([self.lists.places[a, j] - x[a] for a in ti.static(range(self.n))])
            out += self.lists.weights[j] * self.energy(d.norm_sqr(), numbers.soft2)
        return numbers.attraction * (out - self.lists.weights[i] * self.energy(0.0, numbers.soft2))


def make_potential(attraction, StepNumbers):
    """Kernel `potential(numbers)`: energies of particles in the field of all others [J].

    They are written into `potential`; each pair is in two of them.
    """
    lists = attraction.lists

    @ti.kernel
    def potential(numbers: StepNumbers):
        for i in range(numbers.count):
            attraction.note(i)
        for i in range(numbers.count):
            lists.potential[i] = lists.weights[i] * attraction.potential(i, numbers)

    return potential
