"""Energies of the grains, and the ledger of work and losses. Internal units."""

from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from dusttaichi.grains.kernels.measure import ANGULAR, FASTEST, FASTEST_SPIN, KICK, LINEAR
from dusttaichi.grains.ledger_sums import LedgerSums
from dusttaichi.method import Measurement


class ContactNumbers(NamedTuple):
    """Numbers of a contact of two grains, with a wall, with the sphere or None.

    And with each of the surfaces. Structs of kernels.contact_numbers. Where grains differ, those of
    the contact that reaches farthest.
    """

    pair: Any
    wall: Any
    sphere: Any
    surfaces: tuple = ()


class Ledger:
    """Measures energies, losses by channel and work since the start.

    kernel_sums: KernelSums. motion: Motion. sphere: MovingSphere, or None. numbers: ContactNumbers.
    sums: LedgerSums. outside_at_start: energies of forces from outside.
    """

    def __init__(self, kernel_sums, motion, sphere, numbers):
        self._kernel_sums, self._motion, self._sphere = kernel_sums, motion, sphere
        self._state, self._environment = motion.state, motion.environment
        self._numbers, self.sums, self.outside_at_start = numbers, LedgerSums(), None

    # -- measuring -------------------------------------------------------------------------------

    def measure(self):
        """The Measurement now; its parts are `measure_energies`."""
        m = self.measure_energies()
        kinetic = m["kinetic_translation"] + m["kinetic_rotation"] + m["sphere_kinetic"]
        # added up in this order everywhere: the ledger is a small difference of large numbers
        on_sphere = m["potential_sphere"].sum()
        energy = kinetic + m["potential"].sum() + m["potential_wall"].sum() + on_sphere
        work = m["wall_work"] + m["face_work"] + m["push_work"] + m["gravity_work"]
        return Measurement(
            kinetic=kinetic,
            potential=m["potential"].sum() + m["potential_wall"].sum() + on_sphere,
            energy=energy,
            losses=m["loss"] + m["loss_wall"] + m["loss_sphere"],
            lost=m["loss"].sum() + m["loss_wall"].sum() + m["loss_sphere"].sum(),
            work=work + m["sphere_work"] + m["force_work"],
            kick=m["kinetic_kick"],
            bound=self._binding_energy(m),
            parts=m,
        )

    def measure_energies(self):
        """Energies [fJ], counts and extremes of the present moment, as a dict of numbers."""
        kernel_sums, columns = self._kernel_sums, self._kernel_sums.columns
        out = self._measure_sphere()  # whose load is summed before the others are read
        grains, contact_sums = kernel_sums.measure()
        out |= {
            "kinetic_translation": grains[:, LINEAR].sum(),
            "kinetic_rotation": grains[:, ANGULAR].sum(),
            "kinetic_kick": grains[:, KICK].sum() + out["sphere_kick"],
            "largest_speed": grains[:, FASTEST].max(),
            "largest_spin": grains[:, FASTEST_SPIN].max(),
            "wall_work": 0.0,
            "face_work": 0.0,
            "push_work": self._push_work(),
            "gravity_work": 0.0,
            "force_work": 0.0,
        }
        if self._environment.cell is not None:
            moved = self._motion.kinetic_energy_of_images()
            out["kinetic_translation"] += moved
            out["face_work"] = self._face_work(contact_sums[0][:, columns.faces].sum(), moved)
        if self._environment.box is not None:
            loads = kernel_sums.read_loads()
            out["wall_work"] = self.wall_work(loads.wall_force(), loads.impulses())
            out["wall_work"] += self._surface_work(loads)
        losses = kernel_sums.sum_losses(contact_sums)
        for n, (prefix, suffix) in enumerate(
            (("", ""), ("wall_", "_wall"), ("sphere_", "_sphere"))
        ):
            sums = contact_sums[n]
            out[f"{prefix}contacts"] = int(round(sums[:, columns.contacts].sum()))
            out[f"potential{suffix}"] = sums[:, columns.potential].sum(axis=0)
            out[f"loss{suffix}"] = losses[n] - np.array(self.sums.pending[n])
        if self._motion.outside is not None:
            self._add_outside(out)
        tiles = np.concatenate(contact_sums)
        out["largest_overlap"] = tiles[:, columns.deepest].max(initial=0.0)
        out["largest_strain"] = tiles[:, columns.strain].max(initial=0.0)
        return out

    def _add_outside(self, out):
        """Add work and losses of the forces from outside."""
        outside, channels = self._motion.outside, self._state.layout.channels
        kicks = self._kicks_of_sphere()
        gravity, force, losses = outside.energies_since(self.outside_at_start, *kicks)
        out["gravity_work"] = gravity
        out["force_work"] = force + self.sums.script_work
        for channel, lost in losses.items():
            out["loss"][channels.index(channel)] += lost

    def _kicks_of_sphere(self):
        """Its `contact_kicks`, in a tuple of arguments; none without it."""
        return () if self._sphere is None else (self._sphere.contact_kicks(),)

    def _binding_energy(self, m):
        """Binding energy of the current contacts [fJ]: at rest (JKR), or current if they differ."""
        if not self._motion.bodies.are_equal:
            return -(m["potential"][0] + m["potential_wall"][0] + m["potential_sphere"][0])
        pair, wall, sphere, surfaces = self._numbers
        bound = pair.bound * m["contacts"]
        if surfaces:  # of which each has a constant of its own
            bound -= m["potential_wall"][0]
        else:
            bound += wall.bound * m["wall_contacts"]
        if sphere is not None:
            bound += sphere.bound * m["sphere_contacts"]
        return bound

    def binding_energy(self, contacts, potential):
        """Binding energy of that many contacts between grains [fJ]; potential: of their law."""
        equal = self._motion.bodies.are_equal
        return self._numbers.pair.bound * contacts if equal else -potential

    # -- work ------------------------------------------------------------------------------------

    def wall_work(self, force, impulse):
        """Work of the walls since the start, with their current force and impulse."""
        box, sums = self._environment.box, self.sums
        if box is None:
            return 0.0
        # the force of a step acts half before and half after it
        ends = 0.5 * self._environment.dt * (sums.wall_force - force)
        return sums.wall_work + float(np.sum(box.velocity * (impulse - sums.impulse + ends)))

    def _surface_work(self, loads):
        """Work of the surfaces since the start; loads: LoadSums now."""
        if self._environment.domain.surfaces is None:
            return 0.0
        # as in wall_work
        ends = self.sums.surface_power - self._kernel_sums.surface_power()
        work = loads.surface_impulses()[:, 4].sum() + self.sums.surface_jumps
        return float(work + 0.5 * self._environment.dt * ends)

    def _face_work(self, power, moved):
        """Work of the faces since the start [fJ].

        power: of the faces now [fJ/us]; moved: kinetic energy of images over that of the grains.
        """
        state, half = self._state, 0.5 * self._environment.dt
        ends = self.sums.face_power - power
        work = state["face_work"].sum() + half * ends + self.sums.face_jumps
        return float(work + state["wrap_work"].sum() + moved)

    def _push_work(self):
        """Work of the pushes since the start."""
        motion, push = self._motion, self._motion.push
        if not push.works:
            return 0.0
        x, impulse = self._state["x"], self._state.carried_impulse()
        force, (step, dt, _) = motion.sum_contact_loads()[0], self._environment.moment
        return self.sums.push_work + push.work(x, impulse, force, step, dt)

    def _measure_sphere(self):
        """Energies of the sphere itself; zeros without one."""
        if self._sphere is None:
            return dict.fromkeys(("sphere_kinetic", "sphere_kick", "sphere_work"), 0.0)
        load = self._sphere.load()
        kinetic, kick = self._sphere.energies(load)
        return {
            "sphere_load": load,
            "sphere_kinetic": kinetic,
            "sphere_kick": kick,
            "sphere_work": self._sphere.work(load[0], self._sphere.impulses()[:3], self.sums),
        }

    # -- ends of the sums ------------------------------------------------------------------------

    def begin(self):
        """Forces, potentials and pending losses at the start; velocities are half a step back."""
        sums, outside = self.sums, self._motion.outside
        if outside is not None:
            self.outside_at_start = outside.sum_energies(*self._kicks_of_sphere())
        if self._sphere is not None:
            sums.sphere_force = self._sphere.load()[0]
        kernel_sums, domain = self._kernel_sums, self._environment.domain
        _, contact_sums = kernel_sums.measure()
        sums.pending = [loss.tolist() for loss in kernel_sums.sum_losses(contact_sums)]
        loads = kernel_sums.read_loads()
        if domain.cell is not None:
            sums.face_power = domain.cell.power(loads.across_faces(), self._environment.time)
        sums.surface_power = kernel_sums.surface_power()
        sums.wall_force = loads.wall_force()

    def close_sphere(self):
        """Add the work of the sphere to the sums before its drive changes."""
        force, impulse = self._sphere.load()[0], self._sphere.impulses()[:3]
        self.sums.sphere_work = self._sphere.work(force, impulse, self.sums)
        self.sums.sphere_force, self.sums.sphere_impulse = force, impulse

    @contextmanager
    def change_speeds(self, loads):
        """Context in which walls and faces get other speeds; the ledger continues.

        loads: LoadSums now.
        """
        environment, sums = self._environment, self.sums
        cell, time = environment.cell, environment.time
        force, impulse = loads.wall_force(), loads.impulses()
        across = None if cell is None else loads.across_faces()
        work = self.wall_work(force, impulse)
        sums.wall_work, sums.wall_force, sums.impulse = work, force, impulse
        surface_power = self._kernel_sums.surface_power()
        yield
        # the force of a step acts half before and half after it
        jump = self._kernel_sums.surface_power() - surface_power
        sums.surface_jumps += 0.5 * environment.dt * jump
        if cell is not None:
            power = environment.cell.power(across, time) - cell.power(across, time)
            sums.face_jumps += 0.5 * environment.dt * power
