"""The course of a collision: when it is examined, when it is over, and its row of numbers."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from dusttaichi import method
from dusttaichi.analysis.fragments import compute_growth_efficiency, weigh_fragments
from dusttaichi.analysis.outcome import classify_outcome
from dusttaichi.grains.contact_table import ContactTable
from dusttaichi.grains.grain_properties import scale_materials
from dusttaichi.grains.time_step import TimeStep, chosen_step
from dusttaichi.method import Measurement, State
from dusttaichi.results.plain import from_plain, plain
from dusttaichi.running import ledger
from dusttaichi.studies.collide_files import decode_arrays, encode_arrays
from dusttaichi.studies.colliding_bodies import MemberBodies

if TYPE_CHECKING:
    from dusttaichi.grains.members import Look
    from dusttaichi.method import Engine
    from dusttaichi.samples import Sample
    from dusttaichi.scene import Scene

LOOKS = 8  # looks at the bodies while they fly the sum of their outer radii
SAME = 16  # looks over which the fragments must not change, for the collision to be over
EVERY = 4  # looks between two of them at the fragments
DIGITS = 12  # of a growth efficiency: sums of masses round
LEAST = 50  # steps between two looks, at least
# grains of a pair below which all its looks are at multiples of LEAST steps, as are those of the
# many pairs beside it: a look at all of them takes little longer than one at a single pair
FEW = 200
SHORT = 25  # steps between two looks at compression and stretching: a third of a grain's contact
ROUNDED = 13  # digits of a speed that decides about a time step: centres of mass round
# attributes of a collision under way that a checkpoint has, values of JSON
PROGRESS = tuple(
    "first facts initial_velocity normal _nearest touch end flight next_examination next_look "
    "looks unchanged fragment_sizes lost lost_before phase_ends _records".split()
)


class Collision(MemberBodies):
    """A collision, a member of a simulation while it is under way.

    label; scene, sample: Sample; phases: whether the losses of compression and of stretching are
    measured, every SHORT steps; files: whether its row has its `course`; checkpoint: what
    `save` returned, from which it continues. time_step: its TimeStep. measurement, first:
    Measurement of the last look that needed it, and of the start.
    next_examination: its step. phase_ends: energy dissipated [J] from the first touch to the ends
    of compression and of stretching, as far as they are over; lost, lost_before: from the start to
    the last look at them and to the touch. Raises DustError for speeds that its contacts are not
    for.
    """

    first: Measurement
    phase_ends: list[float]
    next_examination: int
    lost_before: float | None
    fragment_sizes: list[int] | None
    facts: dict[str, Any]
    _records: list[tuple[float, float, float, float, list[float]]]

    def __init__(
        self,
        label: str,
        scene: Scene,
        sample: Sample,
        *,
        phases: bool = False,
        files: bool = False,
        checkpoint: dict[str, Any] | None = None,
    ) -> None:
        super().__init__(scene, sample, sample.info["target_grains"])
        self.label, self.phases, self.files, self.checkpoint = label, phases, files, checkpoint
        self.time_step = _chosen_step(scene, sample)

    @property
    def batch_key(self) -> tuple[float, bool]:
        """The same for all that may be side by side: time step, whether its grains are equal."""
        sample = self.sample
        return self.time_step.dt, sample.radii is None and sample.materials is None

    # -- from one simulation to another ----------------------------------------------------------

    def load(self) -> State | None:
        """The State of the checkpoint in which it begins, at `passed` steps; None without one."""
        self.passed, state = 0, None
        if self.checkpoint is not None:
            saved = self.checkpoint
            vars(self).update(saved["progress"], passed=saved["step"])
            self.first = from_plain(Measurement, self.first)
            self.initial_velocity, self.normal = (
                from_plain(np.ndarray, a) for a in (self.initial_velocity, self.normal)
            )
            state = State(decode_arrays(saved["arrays"]), saved["numbers"])
        return state

    def save(self, state: State) -> dict[str, Any]:
        """Its checkpoint, values of JSON; state: that of its member now."""
        progress = {name: plain(getattr(self, name)) for name in PROGRESS}
        saved = {"step": self.step, "progress": progress, "numbers": plain(state.numbers)}
        return saved | {"arrays": encode_arrays(state.arrays)}

    def begin(self, look: Look) -> None:
        """Begin at its first step with a Look that has energies."""
        self.see(look)
        self.first = self.measurement
        self.start()
        info, dt, self.normal = self.sample.info, self.dt, np.full(3, np.nan)
        self.flight = self.touch = 0
        if info["hit"]:
            distance = info["target_outer_radius"] + info["projectile_outer_radius"]
            self.flight = max(LEAST, round(distance / info["speed"] / LOOKS / dt))
            self.touch = int(info["time_to_touch"] / dt)
        stop: Any = self.scene.stop  # which the checks of the block ask for
        steps = round(stop.time / dt)
        self.end = self.touch + steps
        if steps > LEAST:  # so that it stays after the touch
            self.end = self._round_down(self.end)
        self.flight = self._round_down(self.flight)
        self.next_examination = self.next_look = min(self._round_down(self.touch), self.end)
        self.looks = self.unchanged = 0
        self.lost, self.lost_before, self.fragment_sizes = 0.0, None, None
        self.phase_ends, self._records = [], []
        self.facts = self._facts()

    def _round_down(self, steps: int) -> int:
        """The number of steps, of a pair of few grains a multiple of LEAST."""
        return steps if len(self.sample) >= FEW else steps - steps % LEAST

    # -- the course ------------------------------------------------------------------------------

    @property
    def next_step(self) -> int:
        """Step of its GrainEngine at which it is examined next."""
        return self.next_examination - self._steps_before

    def measure_dissipated(self) -> float:
        """Energy dissipated since the start [J]."""
        return float((self.measurement.losses - self.first.losses).sum() * self.units("J"))

    @property
    def needs_energies(self) -> bool:
        """True where the look that is due now needs more than the motion of the bodies."""
        is_first, is_last = self.lost_before is None, self.step >= self.end
        is_checked = (self.looks + 1) % EVERY == 0
        return self.files or self._follows_phases or is_first or is_last or is_checked

    @property
    def _follows_phases(self) -> bool:
        """True until compression and stretching are over, where they are to be measured."""
        return self.phases and len(self.phase_ends) < 2

    def resume(self, look: Look) -> dict[str, Any] | None:
        """Continue with a Look at the step of `next_examination`.

        It has energies where `needs_energies`. The row at the end, of:

        outcome ("miss" without a touch); settled: the fragments no longer change; time [s] after
        the first touch; fragments, masses: grains and shares of the total mass of all of them,
        largest first; growth_efficiency; restitution, None of bodies that break up; impact_energy
        [J] of the relative motion; loss [J] by channel; kinetic, potential [J]: at the end, and its
        change; compression_loss, stretching_loss [J]: dissipated from the touch until the centres
        of mass first stop approaching each other, and then until the bodies are apart or stop
        receding, None where the collision ends before or without `phases`; collision_loss [J]: from
        the touch to the end; residual of the ledger over the impact energy; filling_factor: of the
        target and the projectile (within the characteristic radius); mass_ratio, grains. None
        before the end. Raises GuardStop.
        """
        self.see(look)
        if self.files:
            self._record()
        if not self.sample.info["hit"]:
            row = self.facts | {"outcome": "miss"}
        elif self._follow():
            return None
        else:
            row = self.facts | self._measure_end()
        return row | ({"course": self._list_course()} if self.files else {})

    def _follow(self) -> bool:
        """Look at the bodies; True, and the step of the next look, as long as it is not over.

        It is over where the fragments have not changed for a while, or stop.time after the touch.
        """
        step = self.step
        if step < self.next_examination:
            return True
        if self.lost_before is None:
            self.lost = self.lost_before = self.measure_dissipated()
        else:
            if self._follows_phases:
                self._look_at_phases()
            if step == self.next_look:
                self._look_at_fragments()
        if step >= self.end or self.unchanged >= SAME:
            return False
        if step == self.next_look:
            self.next_look = min(step + self.flight, self.end)
        self.next_examination = self.next_look
        if self._follows_phases:
            self.next_examination = min(step + SHORT, self.next_look)
        return True

    def _look_at_fragments(self) -> None:
        """Check the ledger and count the looks without a change of the fragments."""
        self.update_normal()
        self.looks += 1
        if self.looks % EVERY:
            return
        start = method.Start.from_measurement(self.first)
        member = cast("Engine", self)  # which has of an Engine what the ledger asks
        ledger.check(member, self.measurement, start, self.scene.numerics.ledger_tolerance)
        sizes = self.count_fragments()
        # before anything sticks or breaks there are two bodies as well
        is_unchanged = sizes == self.fragment_sizes and self.looks > LOOKS
        self.unchanged = self.unchanged + EVERY if is_unchanged else 0
        self.fragment_sizes = sizes

    def _look_at_phases(self) -> None:
        """Note the losses of compression and of stretching where these end."""
        line, velocity = self.measure_relative_motion()
        lost, lost_at_last_look = self.measure_dissipated(), self.lost
        before, self.lost = self.lost_before or 0.0, lost
        # the direction changes between the last two times: the mean of both
        if (line @ velocity > 0.0) != bool(self.phase_ends):
            self.phase_ends.append(0.5 * (lost_at_last_look + lost) - before)
        elif self.phase_ends and not self.are_bound():
            self.phase_ends.append(lost - before)

    # -- the row ---------------------------------------------------------------------------------

    def _record(self) -> None:
        """Note the energies [J] and the distance of the bodies [m] now."""
        J, m = self.units("J"), self.measurement
        distance = float(np.linalg.norm(self.measure_relative_motion()[0]))
        losses = ((m.losses - self.first.losses) * J).tolist()
        change = float((m.potential - self.first.potential) * J)
        self._records.append((self.step * self.dt, distance, float(m.kinetic * J), change, losses))

    def _list_course(self) -> dict[str, Any]:
        """Its `course`, values of JSON: the series, and its grains at start and end."""
        *columns, losses = zip(*self._records, strict=True)
        names = ("time", "distance", "kinetic", "potential")
        series: dict[str, Any] = dict(zip(names, columns, strict=True))
        series["loss"] = dict(zip(self.channels, zip(*losses, strict=True), strict=True))
        body = np.repeat([0, 1], [len(grains) for grains in self.bodies])
        grains = {"radius": self.radii, "body": body, "fragment": self.label_grains()}
        grains["position"] = np.array([self.sample.positions, self.measure_positions()])
        return {"series": series, "grains": plain(grains)}

    def _facts(self) -> dict[str, Any]:
        """Columns known before the collision."""
        target, projectile = (self.masses[body].sum() for body in self.bodies)
        info = self.sample.info
        energy = 0.5 * target * projectile / (target + projectile) * info["speed"] ** 2
        filling = self.compute_filling_factors()
        if projectile > target:
            filling = filling[::-1]
        if len(self.count_fragments()) != 2:
            filling = np.full(2, np.nan)
        return {
            "grains": len(self.sample),
            "mass_ratio": float(max(target, projectile) / min(target, projectile)),
            "filling_factor": [float(phi) if np.isfinite(phi) else None for phi in filling],
            "impact_energy": float(energy),
            "outer_radii": float(info["target_outer_radius"] + info["projectile_outer_radius"]),
        }

    def _measure_end(self) -> dict[str, Any]:
        """Columns known at the end."""
        fragments = weigh_fragments(self.label_grains(), self.masses)
        m, J = self.measurement, self.units("J")
        outcome, ends = classify_outcome(fragments, self.masses, self.bodies), self.phase_ends
        residual = ledger.ledger(m, method.Start.from_measurement(self.first))[0] * J
        growth = compute_growth_efficiency(fragments, self.masses, self.bodies)
        return {
            "outcome": outcome,
            "settled": self.unchanged >= SAME,
            "time": (self.step - self.touch) * self.dt,
            "fragments": fragments.grains.tolist(),
            "masses": (fragments.mass / fragments.mass.sum()).tolist(),
            "growth_efficiency": round(growth, DIGITS),
            "restitution": self.restitution_of(outcome),
            "loss": dict(zip(self.channels, (m.losses * J).tolist(), strict=True)),
            "compression_loss": ends[0] if ends else None,
            "stretching_loss": ends[1] - ends[0] if len(ends) > 1 else None,
            "collision_loss": self.measure_dissipated() - (self.lost_before or 0.0),
            "kinetic": float(m.kinetic * J),
            "potential": float((m.potential - self.first.potential) * J),
            "residual": float(residual / self.facts["impact_energy"]),
        }

    def restitution_of(self, outcome: str) -> float | None:
        """Restitution, 0 where the bodies stay together, None of bodies that break up."""
        if outcome in ("sticking", "growth"):
            return 0.0
        return self.measure_restitution() if outcome == "bouncing" else None


def _chosen_step(scene: Scene, sample: Sample) -> TimeStep:
    """The TimeStep of a collision; the same for all of one speed, whatever their masses round."""
    if not scene.boundary.walls and (speed := sample.info["speed"]) > 0.0:
        v = sample.velocities - sample.velocities[0]
        sample = replace(sample, velocities=np.round(v / speed, ROUNDED) * speed)
    scene = scale_materials(scene)
    return chosen_step(ContactTable.for_sample(scene, sample), sample)
