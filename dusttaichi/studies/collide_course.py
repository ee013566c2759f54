"""The course of a collision: when it is examined, when it is over, and its row of numbers."""

from dataclasses import replace

import numpy as np
import xarray as xr

from dusttaichi import method
from dusttaichi.analysis.fragments import compute_growth_efficiency, find_frame_fragments
from dusttaichi.analysis.frame import Frame
from dusttaichi.analysis.outcome import classify_outcome
from dusttaichi.grains import validity
from dusttaichi.grains.contact_table import ContactTable
from dusttaichi.grains.grain_properties import scale_materials
from dusttaichi.grains.time_step import chosen_step
from dusttaichi.physics.geometry import are_in_same_fragment, label_components, largest_first
from dusttaichi.running import ledger
from dusttaichi.samples.materials import Materials
from dusttaichi.samples.touching import deep_overlaps
from dusttaichi.studies.bodies import Encounter

LOOKS = 8  # looks at the bodies while they fly the sum of their outer radii
SAME = 16  # looks over which the fragments must not change, for the collision to be over
EVERY = 4  # looks between two of them at the fragments
DIGITS = 12  # of a growth efficiency: sums of masses round
LEAST = 50  # steps between two looks, at least
SHORT = 25  # steps between two looks at compression and stretching: a third of a grain's contact
ROUNDED = 13  # digits of a speed that decides about a time step: centres of mass round


class Collision(Encounter):
    """A collision, a member of a simulation (grains.members) while it is under way.

    label; scene, sample: Sample; phases: whether the losses of compression and of stretching are
    measured, every SHORT steps; files: whether its row has its `course`. chosen: its TimeStep.
    masses [kg], radii [m]: of the grains (N,). bodies: grains of each. now, first: Measurement now
    and of the start. due: own step of the next look. ends: energy dissipated [J] from the first
    touch to the ends of compression and of stretching, as far as they are over; lost, lost_before:
    from the start to the last look at them and to the touch. Raises DustError for speeds that its
    contacts are not for.
    """

    step_key = "numerics.time_step"

    def __init__(self, label, scene, sample, phases=False, files=False):
        self.label, self.scene, self.sample, self.phases = label, scene, sample, phases
        self.files = files
        materials, count = Materials(scene), len(sample)
        self.masses = np.broadcast_to(materials.masses(sample), count)
        self.radii = np.broadcast_to(materials.radii_of(sample), count)
        self.bodies = np.split(np.arange(count), [sample.info["target_grains"]])
        self.chosen = _chosen_step(scene, sample)

    def enter(self, run, member, first):
        """Begin as a member of a GrainEngine at its first step; first: the Measurement."""
        self.move(run, member, 0)
        self.now, self.first, self.ends = first, first, []
        self.dt, self.channels = run.dt * run.units("s"), run.channels
        self.start()
        self._course, self._records, self._positions = self._follow(), [], [self._position()]

    def move(self, run, member, step):
        """Continue in a GrainEngine; step: its own step where that is at its first one."""
        self.run, self.member, self.units = run, member, run.units
        self._before = step - run.step

    def resume(self, now):
        """Continue with the Measurement of the present step: the row at the end, else None.

        Raises GuardStop.
        """
        self.now = now
        if self.files:
            self._record()
        try:
            self.due = next(self._course)
        except StopIteration as end:
            return end.value | ({"course": self._recorded()} if self.files else {})
        return None

    # -- as the guards see it --------------------------------------------------------------------

    @property
    def step(self):
        """Steps since its start."""
        return self.run.step + self._before

    @property
    def time(self):
        return self.step * self.run.dt

    @property
    def suspect(self):
        return deep_overlaps(self.sample, Materials(self.scene))

    def validate(self, measurement):
        run = self.run
        grains = run.members.grains(self.member)
        parts = run.motion, run.contacts, run.sphere
        validity.validate(measurement, self, *parts, grains=grains)

    # -- motion ----------------------------------------------------------------------------------

    def relative(self):
        """Distance [m] and velocity [m/s] of the first body from the second, (2, 3)."""
        (x1, x2), (v1, v2) = self.now.parts["centre"], self.now.parts["velocity"]
        return np.array([x1 - x2, v1 - v2]) * [[self.units("m")], [self.units("m/s")]]

    def is_one(self):
        """True while one fragment has more than half of the mass of both."""
        return are_in_same_fragment(self.labels(), self.masses, self.bodies)

    def labels(self):
        """Fragment of each grain (N,), 0 the heaviest."""
        pairs = self.run.members.pairs(self.member)
        return largest_first(label_components(pairs, len(self.masses))[1], self.masses)

    def fragments(self):
        """The Fragments now, with velocities half a step back."""
        members = self.run.members
        pairs = members.pairs(self.member).T
        names = ("grain_i", "grain_j")
        contacts = xr.Dataset({n: ("contact", own) for n, own in zip(names, pairs, strict=True)})
        scales = (self.units(unit) for unit in ("m", "m/s", "rad/s"))
        state = (a * scale for a, scale in zip(members.motion(self.member), scales, strict=True))
        cell, open_space = np.full((3, 2), np.nan), np.zeros(3, bool)
        frame = Frame(0, 0.0, 0, *state, self.radii, cell, open_space, contacts)
        return find_frame_fragments(frame, self.masses)

    def _follow(self):
        """Generator of the steps at which it is examined, until it is over; returns its row.

        outcome ("miss" without a touch); settled: the fragments no longer change; time [s] after
        the first touch; fragments, masses: grains and shares of the total mass of all of them,
        largest first; growth_efficiency; restitution, None of bodies that break up; impact_energy
        [J] of the relative motion; loss [J] by channel; kinetic, potential [J]: at the end, and its
        change; compression_loss, stretching_loss [J]: dissipated from the touch until the centres
        of mass first stop approaching each other, and then until the bodies are apart or stop
        receding, None where the collision ends before or without `phases`; collision_loss [J]: from
        the touch to the end; residual of the ledger over the impact energy; filling_factor: of the
        target and the projectile (within the characteristic radius); mass_ratio, grains.
        """
        row = self._facts()
        if not self.sample.info["hit"]:
            return row | {"outcome": "miss"}
        yield from self._fly()
        return row | self._found()

    def _position(self):
        """Positions of its grains [m], (n, 3)."""
        return self.run.members.motion(self.member)[0] * self.units("m")

    def _record(self):
        """Note the energies [J] and the distance of the bodies [m] now."""
        J, m = self.units("J"), self.now
        distance = float(np.linalg.norm(self.relative()[0]))
        losses = ((m.losses - self.first.losses) * J).tolist()
        change = float((m.potential - self.first.potential) * J)
        self._records.append((self.step * self.dt, distance, float(m.kinetic * J), change, losses))

    def _recorded(self):
        """Its `course`, values of JSON: the series, and its grains at start and end."""
        *columns, losses = zip(*self._records, strict=True)
        series = dict(zip(("time", "distance", "kinetic", "potential"), columns, strict=True))
        series["loss"] = dict(zip(self.channels, zip(*losses, strict=True), strict=True))
        body = np.repeat([0, 1], [len(grains) for grains in self.bodies])
        grains = {"radius": self.radii, "body": body, "fragment": self.labels()}
        grains["position"] = np.array([*self._positions, self._position()])
        return {"series": series, "grains": {name: a.tolist() for name, a in grains.items()}}

    def _facts(self):
        """Columns known before the collision."""
        one, other = (self.masses[body].sum() for body in self.bodies)
        info, parts = self.sample.info, self.fragments()
        self.energy = 0.5 * one * other / (one + other) * info["speed"] ** 2
        filling = parts.filling_factor[:2] if len(parts) == 2 else [np.nan] * 2
        return {
            "grains": len(self.sample),
            "mass_ratio": float(max(one, other) / min(one, other)),
            "filling_factor": [_number(value) for value in filling],
            "impact_energy": float(self.energy),
            "outer_radii": float(info["target_outer_radius"] + info["projectile_outer_radius"]),
        }

    def _fly(self):
        """Until the fragments have not changed for a while, or stop.time after the touch."""
        info, dt = self.sample.info, self.dt
        ways = info["target_outer_radius"] + info["projectile_outer_radius"]
        look = max(LEAST, round(ways / info["speed"] / LOOKS / dt))
        touch = int(info["time_to_touch"] / dt)
        end = touch + round(self.scene.stop.time / dt)
        self.touch = touch
        yield min(touch, end)
        self.lost = self.lost_before = self.dissipated()
        start = method.Start.from_measurement(self.first)
        same, last, looks = 0, None, 0
        while self.step < end and same < SAME:
            yield from self._advance(min(look, end - self.step))
            self.look()
            looks += 1
            if looks % EVERY:
                continue
            ledger.check(self, self.now, start, self.scene.numerics.ledger_tolerance)
            now = np.bincount(self.labels()).tolist()
            # before anything sticks or breaks there are two bodies as well
            same = same + EVERY if now == last and looks > LOOKS else 0
            last = now
        self.settled = same >= SAME

    def _advance(self, steps):
        """Steps until that many are made; notes the losses of compression and of stretching."""
        end = self.step + steps
        while self.phases and len(self.ends) < 2 and self.step < end:
            yield min(self.step + SHORT, end)
            line, velocity = self.relative()
            lost, before = self.dissipated(), self.lost
            self.lost = lost
            # the direction changes between the last two times: the mean of both
            if (line @ velocity > 0.0) != bool(self.ends):
                self.ends.append(0.5 * (before + lost) - self.lost_before)
            elif self.ends and not self.is_one():
                self.ends.append(lost - self.lost_before)
        if self.step < end:
            yield end

    def dissipated(self):
        """Energy dissipated since the start [J]."""
        return float((self.now.losses - self.first.losses).sum() * self.units("J"))

    def _found(self):
        """Columns known at the end."""
        parts, m, J = self.fragments(), self.now, self.units("J")
        outcome = classify_outcome(parts, self.masses, self.bodies)
        residual = ledger.ledger(m, method.Start.from_measurement(self.first))[0] * J
        return {
            "outcome": outcome,
            "settled": self.settled,
            "time": (self.step - self.touch) * self.dt,
            "fragments": parts.grains.tolist(),
            "masses": (parts.mass / parts.mass.sum()).tolist(),
            "growth_efficiency": round(
                compute_growth_efficiency(parts, self.masses, self.bodies), DIGITS
            ),
            "restitution": self.restitution_of(outcome),
            "loss": dict(zip(self.channels, (m.losses * J).tolist(), strict=True)),
            "compression_loss": self.ends[0] if self.ends else None,
            "stretching_loss": self.ends[1] - self.ends[0] if len(self.ends) > 1 else None,
            "collision_loss": self.dissipated() - self.lost_before,
            "kinetic": float(m.kinetic * J),
            "potential": float((m.potential - self.first.potential) * J),
            "residual": float(residual / self.energy),
        }

    def restitution_of(self, outcome):
        """Restitution, 0 where the bodies stay together, None of bodies that break up."""
        if outcome in ("sticking", "growth"):
            return 0.0
        return self.restitution() if outcome == "bouncing" else None


def _chosen_step(scene, sample):
    """The TimeStep of a collision; the same for all of one speed, whatever their masses round."""
    if not scene.boundary.walls and (speed := sample.info["speed"]) > 0.0:
        v = sample.velocities - sample.velocities[0]
        sample = replace(sample, velocities=np.round(v / speed, ROUNDED) * speed)
    scene = scale_materials(scene)
    return chosen_step(ContactTable.for_sample(scene, sample), sample)


def _number(value):
    return float(value) if np.isfinite(value) else None
