"""The forces from outside of a scene on one particle, added up in their order."""

from dataclasses import dataclass
from functools import cached_property

from dusttaichi.compute.engine import ti

SOLVER_PASSES = 4
"""Evaluations a step of forces that depend on the velocity: the velocity v of the present follows
from v = v(n-1/2) + dt/2 a(v), by iteration; each pass gains a factor dt/2 times the rate of a."""


@dataclass(frozen=True)
class ForceModel:
    """Laws of the forces of a scene in the order of their blocks (members: `scene.forces`)."""

    laws: tuple = ()

    def __bool__(self):
        return bool(self.laws)

    @cached_property
    def columns(self):
        """For each law its numbers: (column of the table, components)."""
        out, column = [], 0
        for law in self.laws:
            law_columns = []
            for number in law.NUMBERS.values():
                law_columns.append((column, number.components))
                column += number.components
            out.append(tuple(law_columns))
        return tuple(out)

    @property
    def width(self):
        """Length of the table of numbers."""
        return sum(n.components for law in self.laws for n in law.NUMBERS.values())

    @property
    def passes(self):
        """Evaluations of the forces in a step."""
        implicit = any(getattr(law, "USES_VELOCITY", True) for law in self.laws)
        return SOLVER_PASSES if implicit else 1

    @cached_property
    def potentials(self):
        """Numbers of the laws with a potential energy."""
        return tuple(n for n, law in enumerate(self.laws) if hasattr(law, "potential"))

    @cached_property
    def powers(self):
        """(number of the law, whether of the flow of its medium) of the powers that are summed."""
        out = []
        for n, law in enumerate(self.laws):
            if n not in self.potentials:
                out += [(n, False)] + [(n, True)] * hasattr(law, "flow")
        return tuple(out)

    @cached_property
    def channels(self):
        """Channels of the ledger that the losses of the laws go to."""
        named = (getattr(law, "CHANNEL", None) for law in self.laws)
        return tuple(dict.fromkeys(name for name in named if name))

    @property
    def charged(self):
        """True where a law needs the charge of a particle."""
        return any(getattr(law, "USES_CHARGE", False) for law in self.laws)

    @property
    def scripted(self):
        """True where a law needs the force that a script sets."""
        return any(getattr(law, "USES_SCRIPT", False) for law in self.laws)


@ti.data_oriented
class Forces:
    """Evaluation of a ForceModel on one particle.

    table: field of the numbers of its laws from `first` on, in the units of the method. particle:
    struct of the particle (see scene.forces).
    """

    def __init__(self, model, table, first):
        self.model, self.table, self.first = model, table, first
        self.laws, self.columns = model.laws, model.columns
        self.potentials = tuple(enumerate(model.potentials))
        self.powers = tuple(enumerate(model.powers))
        vector = ti.types.vector(3, ti.f64)
        self.structs = tuple(
            ti.types.struct(
                **{
                    name: ti.f64 if number.components == 1 else vector
                    for name, number in law.NUMBERS.items()
                }
            )
            for law in model.laws
        )

    @ti.func
    def read(self, entry: ti.template()):
        """A number of a law: a scalar or a vector."""
        column = ti.static(self.first + entry[0])
        if ti.static(entry[1] == 1):
            return self.table[column]
        else:
            return ti.Vector([self.table[column + k] for k in range(3)])

    @ti.func
    def numbers(self, n: ti.template()):
        """Struct of the numbers of law n."""
        return self.structs[n](*[self.read(entry) for entry in self.columns[n]])

    @ti.func
    def act(self, n: ti.template(), particle):
        """(acceleration, angular acceleration) by law n."""
        linear, angular = ti.Vector.zero(ti.f64, 3), ti.Vector.zero(ti.f64, 3)
        if ti.static(hasattr(self.laws[n], "acceleration")):
            linear = self.laws[n].acceleration(self.numbers(n), particle)
        if ti.static(hasattr(self.laws[n], "angular_acceleration")):
            angular = self.laws[n].angular_acceleration(self.numbers(n), particle)
        return linear, angular

    @ti.func
    def act_together(self, particle):
        """(acceleration, angular acceleration) by all laws."""
        linear, angular = self.act(0, particle)
        for n in ti.static(range(1, len(self.laws))):
            added, turning = self.act(n, particle)
            linear += added
            angular += turning
        return linear, angular

    @ti.func
    def solve(self, particle: ti.template(), kick, turn, half):
        """Accelerations at the velocity and spin of the present, which the particle then has.

        particle: with those of half a step before. kick, turn: their change in that half step, of
        length `half`, by everything else.
        """
        velocity, spin = particle.velocity + kick, particle.spin + turn
        particle.velocity = velocity
        particle.spin = spin
        linear, angular = self.act_together(particle)
        for _ in ti.static(range(self.model.passes - 1)):
            particle.velocity = velocity + half * linear
            particle.spin = spin + half * angular
            linear, angular = self.act_together(particle)
        return linear, angular

    @ti.func
    def power(self, k: ti.template(), particle, velocity, spin):
        """Power of entry k of `powers` at a velocity and a spin."""
        n, of_flow = ti.static(self.model.powers[k])
        linear, angular = self.act(n, particle)
        out = 0.0
        if ti.static(of_flow):
            out = particle.mass * linear.dot(self.laws[n].flow(self.numbers(n), particle))
        else:
            out = particle.mass * linear.dot(velocity) + particle.inertia * angular.dot(spin)
        return out

    @ti.func
    def potential(self, k: ti.template(), particle):
        """Potential energy of entry k of `potentials`."""
        n = ti.static(self.model.potentials[k])
        return self.laws[n].potential(self.numbers(n), particle)
