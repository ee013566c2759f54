"""Task of a worker process of a study of collisions: one of them."""

from functools import lru_cache

import numpy as np
import xarray as xr

from dusttaichi import method, samples
from dusttaichi.analysis.fragments import compute_growth_efficiency, find_frame_fragments
from dusttaichi.analysis.frame import Frame
from dusttaichi.analysis.outcome import classify_outcome
from dusttaichi.grains.contacts import contact_state
from dusttaichi.grains.measure import grain_state
from dusttaichi.running import ledger
from dusttaichi.scene import from_yaml
from dusttaichi.studies.bodies import TwoBodies

LOOKS = 8  # looks at the bodies while they fly the sum of their outer radii
SAME = 16  # looks over which the fragments must not change, for the collision to be over
EVERY = 4  # looks between two of them at the fragments
DIGITS = 12  # of a growth efficiency: sums of masses round
LEAST = 50  # steps between two looks, at least
SHORT = 25  # steps between two looks at compression and stretching: a third of a grain's contact


def run(parent, *, scene, sample, phases=False):
    """Row of one collision of a scene (text of its YAML) with a block `sample`."""
    return make_collision(_base(scene).with_value("sample", sample), phases)


_base = lru_cache(1)(from_yaml)  # the same for all collisions of a study


def make_collision(scene, phases=False):
    """One collision to its end: a row of plain numbers, as JSON has them, SI.

    phases: True where the losses of compression and of stretching are measured, every SHORT steps.

    outcome ("miss" without a touch); settled: the fragments no longer change; time [s] after the
    first touch; fragments, masses: grains and shares of the total mass of all of them, largest
    first; growth_efficiency; restitution, None of bodies that break up; impact_energy [J] of the
    relative motion; loss [J] by channel; kinetic, potential [J]: at the end, and its change;
    compression_loss, stretching_loss [J]: dissipated from the touch until the centres of mass first
    stop approaching each other, and then until the bodies are apart or stop receding, None where
    the collision ends before or without `phases`; collision_loss [J]: from the touch to the end;
    residual of the ledger over the impact energy; filling_factor: of the target and the projectile
    (within the characteristic radius); mass_ratio, grains.
    Raises GuardStop where the numbers can no longer be trusted, and DustError.
    """
    sample = samples.make(scene)
    motion = _Motion(scene, sample, phases)
    row = motion.facts()
    if not sample.info["hit"]:
        return row | {"outcome": "miss"}
    motion.fly()
    return row | motion.found()


class _Motion(TwoBodies):
    """A collision under way.

    first: the Measurement of the start. phases: ends are wanted. ends: energy dissipated [J] from
    the first touch to the ends of compression and of stretching, as far as they are over; lost,
    lost_before: from the start to the last look at them and to the touch.
    """

    def __init__(self, scene, sample, phases):
        super().__init__(scene, sample)
        self.first, self.phases, self.ends = self.sim.measure(), phases, []

    def facts(self):
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

    def fragments(self):
        (x, v, w), units = grain_state(self.sim.sim), self.sim.units
        pairs = contact_state(self.sim.sim)
        contacts = xr.Dataset({k: ("contact", pairs[k]) for k in ("grain_i", "grain_j")})
        state = x * units("m"), v * units("m/s"), w * units("rad/s")
        cell, open_space = np.full((3, 2), np.nan), np.zeros(3, bool)
        frame = Frame(0, 0.0, 0, *state, self.radii, cell, open_space, contacts)
        return find_frame_fragments(frame, self.masses)

    def fly(self):
        """Until the fragments have not changed for a while, or stop.time after the touch."""
        info, dt = self.sample.info, self.dt
        ways = info["target_outer_radius"] + info["projectile_outer_radius"]
        look = max(LEAST, round(ways / info["speed"] / LOOKS / dt))
        touch = int(info["time_to_touch"] / dt)
        end = touch + round(self.scene.stop.time / dt)
        self.touch = touch
        self.sim.advance(min(touch, end))
        self.lost = self.lost_before = self.dissipated()
        start = method.Start.from_measurement(self.first)
        same, last, looks = 0, None, 0
        while self.sim.step < end and same < SAME:
            self.advance(min(look, end - self.sim.step))
            self.look()
            looks += 1
            if looks % EVERY:
                continue
            ledger.check(self.sim, self.sim.measure(), start, self.scene.numerics.ledger_tolerance)
            parts = self.fragments()
            now = parts.grains.tolist()
            # before anything sticks or breaks there are two bodies as well
            same = same + EVERY if now == last and looks > LOOKS else 0
            last = now
        self.settled = same >= SAME

    def advance(self, steps):
        """Advance by a number of steps; note the losses of compression and of stretching."""
        end = self.sim.step + steps
        while self.phases and len(self.ends) < 2 and self.sim.step < end:
            self.sim.advance(min(SHORT, end - self.sim.step))
            line, velocity = self.relative()
            lost, before = self.dissipated(), self.lost
            self.lost = lost
            # the direction changes between the last two times: the mean of both
            if (line @ velocity > 0.0) != bool(self.ends):
                self.ends.append(0.5 * (before + lost) - self.lost_before)
            elif self.ends and not self.is_one():
                self.ends.append(lost - self.lost_before)
        self.sim.advance(end - self.sim.step)

    def dissipated(self, measurement=None):
        """Energy dissipated since the start [J], now or at a Measurement."""
        losses = (measurement or self.sim.measure()).losses
        return float((losses - self.first.losses).sum() * self.sim.units("J"))

    def found(self):
        """Columns known at the end."""
        parts, m, J = self.fragments(), self.sim.measure(), self.sim.units("J")
        outcome = classify_outcome(parts, self.masses, self.bodies)
        residual = ledger.ledger(m, method.Start.from_measurement(self.first))[0] * J
        return {
            "outcome": outcome,
            "settled": self.settled,
            "time": (self.sim.step - self.touch) * self.dt,
            "fragments": parts.grains.tolist(),
            "masses": (parts.mass / parts.mass.sum()).tolist(),
            "growth_efficiency": round(
                compute_growth_efficiency(parts, self.masses, self.bodies), DIGITS
            ),
            "restitution": self.restitution_of(outcome),
            "loss": dict(zip(self.sim.channels, (m.losses * J).tolist(), strict=True)),
            "compression_loss": self.ends[0] if self.ends else None,
            "stretching_loss": self.ends[1] - self.ends[0] if len(self.ends) > 1 else None,
            "collision_loss": self.dissipated(m) - self.lost_before,
            "kinetic": float(m.kinetic * J),
            "potential": float((m.potential - self.first.potential) * J),
            "residual": float(residual / self.energy),
        }

    def restitution_of(self, outcome):
        """Restitution, 0 where the bodies stay together, None of bodies that break up."""
        if outcome in ("sticking", "growth"):
            return 0.0
        return self.restitution() if outcome == "bouncing" else None


def _number(value):
    return float(value) if np.isfinite(value) else None
