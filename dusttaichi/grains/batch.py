"""Many small scenes in one launch: independent of each other, they differ in their samples only.

A launch costs the same for two grains as for thousands, so speeds, angles, impact parameters and
seeds go side by side. Grains of different scenes never see each other (kernels.search gives each
scene cells of its own), and every scene moves as it would alone, bit for bit.
"""

from dataclasses import dataclass, replace
from math import nan

import numpy as np
import scipy

from dusttaichi import units
from dusttaichi.errors import DustError
from dusttaichi.grains.build import build

LOOKS = 200  # moments of a run at which the line between the bodies is examined


@dataclass(frozen=True)
class Outcome:
    """Present outcome of one scene of a batch.

    bound: one fragment has more than half of the grains of both bodies; of a body at a wall: one of
    its grains touches it. before, after [m/s]: speed of the centres of mass (of the body and the
    wall) along the normal, of approach at the start and of present separation. normal: (3,) unit
    vector, the line between the centres where they were closest, or the normal of the wall; it says
    little of bodies that break up, whose centres pass through each other. fragments: sets of grains
    connected by contacts; largest: grains of the largest. kinetic [J]: of translation and rotation.
    """

    bound: bool
    before: float
    after: float
    normal: np.ndarray
    fragments: int
    largest: int
    contacts: int
    kinetic: float

    @property
    def coefficient(self):
        """Coefficient of restitution: after over before, 0 where the bodies are bound.

        Not a number where they do not approach along the normal: they pass each other.
        """
        if self.bound:
            return 0.0
        return self.after / self.before if self.before > 0.0 else nan


def build_batch(scene, samples):
    """The Batch of these samples (dusttaichi.samples.Sample), each with all else as in the scene.

    The time step is that of the largest of them. Raises DustError where there are none, for a
    periodic boundary, and for walls that would not be at the same places around each sample.
    """
    if not samples:
        raise DustError("A batch needs samples; allowed: one or more.")
    if scene.boundary.periodic_axes:
        raise DustError(
            "boundary.kind = periodic: scenes of a batch have no periodic faces; allowed: open, "
            "or walls."
        )
    if scene.boundary.walls:
        _check_walls(samples)
    scenes = np.repeat(np.arange(len(samples)), [len(sample) for sample in samples])
    return Batch(build(scene, joined(samples), scenes=scenes), samples)


def _check_walls(samples):
    """Walls are laid out around a sample: all must take the same room."""

    def room(sample):
        return np.stack([sample.positions.min(axis=0), sample.positions.max(axis=0)])

    for number, sample in enumerate(samples):
        if not np.array_equal(room(sample), room(samples[0])):
            raise DustError(
                f"sample {number} of the batch does not take the same room as sample 0, but they "
                "share their walls; allowed: samples that differ in velocities and spins only."
            )


def joined(samples):
    """One Sample of all grains, in the order of the samples."""
    first = _first(samples)
    brought = [(s.contacts, n) for s, n in zip(samples, first, strict=False) if s.contacts]
    contacts = None
    if brought:
        contacts = {
            key: np.concatenate([c[key] + (n if key in ("i", "j") else 0) for c, n in brought])
            for key in brought[0][0]
        }
    arrays = {
        name: np.concatenate([getattr(s, name) for s in samples])
        for name in ("positions", "velocities", "spins", "radii", "materials")
        if getattr(samples[0], name) is not None
    }
    return replace(samples[0], **arrays, contacts=contacts, info={})


def _first(samples):
    """Number of the first grain of each sample, and the number of all."""
    return np.cumsum([0, *(len(sample) for sample in samples)])


class Batch:
    """Scenes in motion, side by side. sim: the Simulation of all of them; samples: one a scene."""

    def __init__(self, sim, samples):
        self.sim, self.samples = sim, list(samples)
        self.first = _first(samples)
        self.target_grains = [_target_grains(sample) for sample in samples]
        own, one = sim.polydisperse, np.ones(sim.grains)
        # [pg], [pg um^2], in the samples' order
        self.mass = sim.mass * one if own is None else own.mass
        self.inertia = sim.inertia * one if own is None else own.inertia
        self._nearest = np.full(len(samples), np.inf)
        self._normal = np.zeros((len(samples), 3))
        self._start = None

    def __len__(self):
        return len(self.samples)

    @property
    def time(self):
        """Simulated time [s]."""
        return self.sim.time * units.TIME

    def advance(self, steps):
        """Make `steps` steps."""
        self.sim.advance(steps)

    def run_until(self, time):
        """Advance to `time` [s], and examine the line between the bodies of each scene on the way.

        That is for `outcomes`, at LOOKS moments.
        """
        self._look()
        left = max(0, int(np.ceil(time / units.TIME / self.sim.dt - 1e-9)) - self.sim.step)
        for steps in np.diff(np.linspace(0, left, min(LOOKS, max(left, 1)) + 1).astype(int)):
            self.advance(int(steps))
            self._look()

    # -- what there is ---------------------------------------------------------------------------

    def grain_state(self, scene):
        """Positions [um], velocities [um/us], spins [rad/us] of one scene, (N, 3) each."""
        return self.sim.grain_state()[:, self.first[scene] : self.first[scene + 1]]

    def contact_state(self, scene):
        """Contacts between the grains of one scene, as Simulation.contact_state has them."""
        return self._of(scene, self.sim.contact_state(), ("grain_i", "grain_j"))

    def wall_contact_state(self, scene):
        """Contacts with walls of one scene, as Simulation.wall_contact_state has them."""
        return self._of(scene, self.sim.wall_contact_state(), ("grain",))

    def _of(self, scene, contacts, grains):
        low, high = self.first[scene], self.first[scene + 1]
        own = (contacts[grains[0]] >= low) & (contacts[grains[0]] < high)
        found = {name: values[own] for name, values in contacts.items()}
        return found | {name: found[name] - low for name in grains}

    # -- outcomes --------------------------------------------------------------------------------

    def outcomes(self):
        """The Outcome of each scene: a list. Raises DustError for scenes without two bodies."""
        self._look()
        _, v, w = self.sim.grain_state()
        pairs = self.sim.contact_state()
        i, j = pairs["grain_i"], pairs["grain_j"]
        graph = scipy.sparse.coo_array(
            (np.ones(len(i), np.int8), (i, j)), shape=(self.sim.grains,) * 2
        )
        label = scipy.sparse.csgraph.connected_components(graph, directed=False)[1]
        scene_of = np.repeat(np.arange(len(self)), np.diff(self.first))
        contacts = np.bincount(scene_of[i], minlength=len(self))
        touching = np.zeros(self.sim.grains, bool)
        if self.sim.box is not None:
            touching[self.sim.wall_contact_state()["grain"]] = True
        relative = self._relative_velocities(v)
        found = []
        for n in range(len(self)):
            own = slice(self.first[n], self.first[n + 1])
            parts = np.unique(label[own], return_inverse=True)[1]
            normal = self._normal[n]
            kinetic = np.sum(self.mass[own] * np.sum(v[own] ** 2, axis=1))
            kinetic += np.sum(self.inertia[own] * np.sum(w[own] ** 2, axis=1))
            found.append(
                Outcome(
                    bound=self._bound(n, parts, touching[own]),
                    before=-float(self._start[n] @ normal) * units.SPEED,
                    after=float(relative[n] @ normal) * units.SPEED,
                    normal=normal.copy(),
                    fragments=int(parts.max()) + 1,
                    largest=int(np.bincount(parts).max()),
                    contacts=int(contacts[n]),
                    kinetic=0.5 * float(kinetic) * units.ENERGY,
                )
            )
        return found

    def _bound(self, n, parts, touching):
        split = self.target_grains[n]
        if split is None:
            return bool(touching.any())
        one, other = (
            np.bincount(part, minlength=len(parts)) for part in (parts[:split], parts[split:])
        )
        return bool(np.any((2 * one > split) & (2 * other > len(parts) - split)))

    def _look(self):
        """Keep the normal of each scene at the moment when its bodies have been closest."""
        x, v, _ = self.sim.grain_state()
        lines = self._lines(x)
        distance = np.linalg.norm(lines, axis=1)
        closer = distance < self._nearest
        self._nearest[closer] = distance[closer]
        self._normal[closer] = lines[closer] / distance[closer, None]
        if self._start is None:
            self._start = self._relative_velocities(v)

    def _lines(self, x):
        """From the second body, or the nearest wall, to the first: (scenes, 3) [um]."""
        lines = np.empty((len(self), 3))
        for n, split in enumerate(self.target_grains):
            own = x[self.first[n] : self.first[n + 1]]
            if split is not None:
                lines[n] = self._apart(n, own)
                continue
            wall, distance = self._nearest_wall(own)
            lines[n] = distance * self.sim.box.normal[wall]
        return lines

    def _nearest_wall(self, x):
        box = self.sim.box
        if box is None:
            raise DustError(
                "A collision needs two bodies; allowed: sample.kind pair or collision, or a "
                "boundary with a wall."
            )
        distance = x @ box.normal.T - box.offsets(self.sim.time)
        distance = np.where(box.present == 1, distance, np.inf).min(axis=0)
        return int(np.argmin(distance)), float(distance.min())

    def _relative_velocities(self, v):
        """Velocity of the first body against the second or the wall: (scenes, 3) [um/us]."""
        out = np.empty((len(self), 3))
        for n, split in enumerate(self.target_grains):
            own = v[self.first[n] : self.first[n + 1]]
            if split is not None:
                out[n] = self._apart(n, own)
                continue
            box = self.sim.box
            wall = int(np.argmax(box.normal @ self._normal[n]))
            mass = self.mass[self.first[n] : self.first[n + 1]]
            mean = np.average(own, axis=0, weights=mass)
            out[n] = mean - box.speed[wall] * box.normal[wall]
        return out

    def _apart(self, n, values):
        """Mean of values (N, 3) over the first body less that over the second, by mass."""
        mass, split = self.mass[self.first[n] : self.first[n + 1]], self.target_grains[n]
        one = np.average(values[:split], axis=0, weights=mass[:split])
        return one - np.average(values[split:], axis=0, weights=mass[split:])


def _target_grains(sample):
    """Grains of the first body, which come first; None of a sample that is one body."""
    if sample.info.get("kind") == "pair":
        return 1
    return sample.info.get("target_grains")
