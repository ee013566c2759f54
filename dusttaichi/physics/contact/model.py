"""The contact model of a scene: effects that act together, and their evaluation on one contact.

The model is composed once, in Python (`effect_registry.chosen_model`). The history and the numbers
of a contact, the channels of the ledger and the columns of the potential energy all follow from
what the effects declare.
"""

from dataclasses import dataclass
from functools import cached_property

from dusttaichi.compute.engine import ti
from dusttaichi.physics.contact import kinematics
from dusttaichi.physics.contact.effect_numbers import CHANNELS, SPRINGS, History

COMMON = {
    "xi": History("m", "rolling displacement (S12 eq 8)", 3),
    "zeta": History("m", "sliding displacement (S12 eqs 9, 24)", 3),
    "touched": History("1", "1 where the contact touches"),
}
"""History of every contact, whatever its effects: its displacements."""


@dataclass(frozen=True)
class ContactModel:
    """Effects of the contacts of a scene: (kind, law) pairs in the order in which they act.

    Effects along the normal come first: they act from the first touch on, and on walls whatever the
    strength of the walls' springs.
    """

    effects: tuple
    newton_steps: int = 2  # of laws that iterate

    @property
    def normal(self):
        """The normal law."""
        return self.effects[0][1]

    @cached_property
    def radial(self):
        """Laws along the normal but the normal law itself."""
        return tuple(law for effect, law in self.effects[1:] if getattr(law, "RADIAL", False))

    @cached_property
    def springs(self):
        """All other laws."""
        return tuple(law for effect, law in self.effects[1:] if not getattr(law, "RADIAL", False))

    @cached_property
    def laws(self):
        """Laws that dissipate, in the order of the losses that `Mechanics.update` returns."""
        return self.radial + self.springs

    @cached_property
    def numbers(self):
        """Name -> Constant of all constants of a contact."""
        return {name: n for _, law in self.effects for name, n in law.NUMBERS.items()}

    @cached_property
    def history(self):
        """Name -> History of all numbers that a contact stores."""
        return COMMON | {name: h for law in self.laws for name, h in law.HISTORY.items()}

    @cached_property
    def channels(self):
        """Names of the channels of the ledger."""
        return (*CHANNELS, *(law.CHANNEL for law in self.laws if law.CHANNEL not in CHANNELS))

    @cached_property
    def potentials(self):
        """Names of the columns of the potential energy."""
        names = [effect for effect, law in self.effects if law in self.springs]
        return (*SPRINGS, *(effect for effect in names if effect not in SPRINGS))


@ti.data_oriented
class Mechanics:
    """Evaluation of the effects of a ContactModel on one contact, in the float type `dtype`.

    motion: Motion of the contact (kinematics). history: struct of its history, by the names of
    ContactModel.history. constants: struct of its numbers. flat: whether the second body is a wall.
    """

    def __init__(self, model, dtype):
        self.model, self.dtype = model, dtype
        self.Motion, self.Load = kinematics.motion_type(dtype), kinematics.load_type(dtype)
        self.respond = model.normal.response(model.newton_steps)
        self.radial, self.springs = model.radial, model.springs
        effect_of_law = {law: effect for effect, law in model.effects}
        columns = model.potentials
        self.columns = tuple(columns.index(effect_of_law[law]) for law in self.springs)
        self.losses, self.potentials = len(model.laws), len(columns)
        self.pushing = tuple(law for law in self.radial if hasattr(law, "push"))
        self.forming = tuple(law for law in model.laws if hasattr(law, "form"))
        self.pending = tuple(law for law in model.laws if hasattr(law, "pending"))

    @ti.func
    def touch(self, motion: ti.template(), history: ti.template(), constants):
        """Set whether the contact touched a step ago and touches now.

        It forms at first contact and exists until pull-off.
        """
        motion.touched_before = history.touched
        motion.touches = ti.select(
            motion.overlap + motion.touched_before * constants.reach > 0.0, 1.0, 0.0
        )

    @ti.func
    def press(self, motion: ti.template(), constants):
        """Set the elastic response of the contact."""
        response = self.respond(motion, constants)
        motion.elastic_force, motion.elastic_energy = response.force, response.energy

    @ti.func
    def update(
        self, motion: ti.template(), history: ti.template(), constants, dt, flat: ti.template()
    ):
        """Update the history: rotated with the grains and reset to the limits.

        Returns a vector of the energies dissipated, by law.
        """
        lost = ti.Vector.zero(self.dtype, ti.static(max(self.losses, 1)))
        # before the response: its roots and divisions wait for each other, and where they come
        # first they fill the scheduler of a core (4 % of the pass over pairs)
        kinematics.carry(motion, history, constants)
        self.press(motion, constants)
        for n in ti.static(range(len(self.radial))):
            lost[n] = self.radial[n].update(motion, history, constants, dt)
        first = ti.static(len(self.radial))
        for n in ti.static(range(len(self.springs))):
            # without deviations pointers are along the line of centres, which rotates as a grain
            # flies past
            lost[first + n] = motion.touched_before * self.springs[n].update(
                motion, history, constants, dt
            )
        kinematics.point(motion, history, constants, flat)
        return lost

    @ti.func
    def evaluate(self, motion: ti.template(), history: ti.template(), constants, strength):
        """(load, energies) of a configuration.

        Struct of force, torque_1, torque_2 on the grains, and a vector of the potential energies by
        column. strength: factor on the springs of a wall but the normal one.
        """
        push = motion.touches * motion.elastic_force
        for law in ti.static(self.pushing):
            push += law.push(history)
        load, stored = self.springs_of(
            motion, history, constants, motion.touches * motion.touched_before * strength
        )
        load.force += motion.normal * push
        stored[0] += motion.touches * motion.elastic_energy
        return load, stored

    @ti.func
    def springs_of(self, motion: ti.template(), history: ti.template(), constants, weight):
        """(load, energies) of all springs but the normal one, times a weight."""
        stored = ti.Vector.zero(self.dtype, self.potentials)
        load = self.Load()
        for n in ti.static(range(len(self.springs))):
            stored[self.columns[n]] = weight * self.springs[n].evaluate(
                motion, history, constants, load
            )
        force = (load.force + motion.normal * load.push) * weight
        torque_1 = (load.pull_1.cross(motion.pointer_1) + load.torque_1) * weight
        torque_2 = (load.pull_2.cross(motion.pointer_2) + load.torque_2) * weight
        return ti.Struct(force=force, torque_1=torque_1, torque_2=torque_2), stored
