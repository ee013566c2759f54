"""Sticking speed and restitution of a scene's collision: many speeds side by side in one batch."""

import itertools
from dataclasses import dataclass, replace
from math import inf, sqrt
from pathlib import Path

import numpy as np
import xarray as xr

from dusttaichi import samples, units
from dusttaichi.domain.surroundings import glued
from dusttaichi.errors import DustError
from dusttaichi.grains.batch import build_batch
from dusttaichi.grains.build import bodies_of, chosen_step
from dusttaichi.physics.contact import constants
from dusttaichi.results import provenance
from dusttaichi.samples.ballistic import first_touch
from dusttaichi.samples.collision import FLIGHT
from dusttaichi.scene import quantities
from dusttaichi.studies.ensemble.scenes import grid

TOGETHER = 16  # speeds of a batch
ROUNDS = 12  # batches before a search is given up
WIDER = 10.0  # factor by which a bracket grows that does not hold the sticking speed
JUMPS = 0.77224  # energy lost on forming and breaking, of F_c delta0: 0.69886 + 0.07338
# A contact is found up to v dt too late, which raises the sticking speed by up to
# 0.58 v dt/delta0: three quarters of the tolerance are left.
LATEST = 0.4


@dataclass(frozen=True)
class Sticking:
    """The lowest speed at which a collision does not end bound.

    low, high [m/s]: of all speeds tried two next to each other; the first ends bound, the second
    does not. closed [m/s]: `closed_form`. speeds [m/s], bound: all that were tried, rising.
    time_step [s].
    """

    low: float
    high: float
    closed: float
    speeds: np.ndarray
    bound: np.ndarray
    time_step: float

    @property
    def speed(self):
        """The middle of the bracket [m/s]."""
        return 0.5 * (self.low + self.high)

    @property
    def again(self):
        """Speeds tried above the bracket that ended bound all the same [m/s]."""
        return self.speeds[(self.speeds > self.high) & self.bound]


def sticking(scene, tolerance=1e-3, low=None, high=None, say=lambda text: None):
    """The Sticking of a scene: sample kind pair or collision, or explicit grains at a wall.

    tolerance: largest width of the bracket over its lower end. low, high [m/s]: where to look
    first, by default about the closed form. say: told of each batch. The scene's stop tells how
    long a collision is followed after the first touch.
    Raises DustError for a scene without two bodies, without a time to stop at, whose bodies miss
    each other, or where no sticking speed is found.
    """
    collision = Collision(scene, tolerance)
    few = len(collision.sample) <= 2
    low = collision.closed * (0.25 if few else 1.0) if low is None else low
    high = max(collision.closed * (4.0 if few else 100.0), 4.0 * low) if high is None else high
    if not 0.0 < low < high:
        raise DustError(
            f"--low {low:g} m/s, --high {high:g} m/s: both must be above 0, and the second above "
            "the first."
        )
    tried = {}
    inside = slice(None)  # of the speeds from low to high; the ends are left out once known
    for _ in range(ROUNDS):
        count = TOGETHER if inside == slice(None) else TOGETHER + 2
        speeds = np.geomspace(low, high, count)[inside]
        found = collision.outcomes(speeds)
        tried |= {float(v): outcome.bound for v, outcome in zip(speeds, found, strict=True)}
        all_speeds = np.array(sorted(tried))
        bound = np.array([tried[v] for v in all_speeds])
        first = int(np.argmin(bound))
        say(
            f"{len(speeds)} speeds from {speeds[0]:.5g} to {speeds[-1]:.5g} m/s: "
            f"{sum(outcome.bound for outcome in found)} bound"
        )
        if bound.all():
            low, high, inside = high, high * WIDER, slice(None)
        elif first == 0:
            low, high, inside = low / WIDER, low, slice(None)
        else:
            low, high = float(all_speeds[first - 1]), float(all_speeds[first])
            inside = slice(1, -1)
            if high - low <= tolerance * low:
                return Sticking(low, high, collision.closed, all_speeds, bound, collision.time_step)
    raise DustError(
        f"No sticking speed was found: between {all_speeds[0]:.3g} and {all_speeds[-1]:.3g} m/s "
        f"{'all' if bound.all() else 'not one' if not bound.any() else 'some'} of the collisions "
        "end bound. Try another --low and --high, or a longer stop.time."
    )


def restitution_map(scene, speeds, tolerance=1e-3, settings=()):
    """Outcomes of the scene's collision at these speeds [m/s], as an xr.Dataset in SI.

    settings: texts "key=value,value" of the YAML; each is a dimension before the speed.
    restitution, bound, fragments, largest_fragment, contacts, kinetic: (..., speed). The attribute
    sticking_speed is the closed form of the first point, closed_form tells whether it holds there
    (two single grains, or one and a wall, without damping, head-on). Points that differ in their
    samples only run as one batch. Raises DustError as `sticking` does.
    """
    axes, scenes = grid(scene, list(settings))
    collisions = [Collision(point, tolerance) for point in scenes]
    speeds = np.asarray(speeds, float)
    found = _all_outcomes(collisions, speeds)
    collision = collisions[0]
    dims = (*(axis.key for axis in axes), "speed")
    shape = (*(len(axis.texts) for axis in axes), len(speeds))
    columns = {
        "restitution": ([o.coefficient for o in found], "1", "coefficient of restitution"),
        "bound": ([int(o.bound) for o in found], "1", "1 where the bodies end bound"),
        "fragments": ([o.fragments for o in found], "1", "sets of grains connected by contacts"),
        "largest_fragment": ([o.largest for o in found], "1", "grains of the largest fragment"),
        "contacts": ([o.contacts for o in found], "1", "contacts between grains"),
        "kinetic": ([o.kinetic for o in found], "J", "kinetic energy at the end"),
    }
    data = xr.Dataset(
        {
            name: (dims, np.array(values).reshape(shape), {"units": unit, "long_name": text})
            for name, (values, unit, text) in columns.items()
        },
        {"speed": ("speed", speeds, {"units": "m/s", "long_name": "speed of approach"})}
        | {
            axis.key: (axis.key, axis.coordinate, {"units": axis.unit} if axis.unit else {})
            for axis in axes
        },
    )
    data.attrs = provenance(
        scene.source,
        collision.scene.to_yaml(),
        title=scene.name,
        time_step=collision.time_step,
        sticking_speed=collision.closed,
        closed_form=int(collision.is_closed),
    )
    return data


def _all_outcomes(collisions, speeds):
    """The batch.Outcome of every collision at every speed, the speeds fastest: a list."""
    together = {}
    for n, collision in enumerate(collisions):
        # what a batch shares: everything of the scene but its sample
        rest = collision.scene.model_copy(update={"sample": None, "numerics": None, "name": ""})
        together.setdefault(repr(rest), []).append(n)
    found = [None] * len(collisions)
    for members in together.values():
        least = min((collisions[n] for n in members), key=lambda c: c.time_step)
        outcomes = least.outcomes(speeds, [collisions[n] for n in members])
        for k, n in enumerate(members):
            found[n] = outcomes[k * len(speeds) : (k + 1) * len(speeds)]
    return [outcome for part in found for outcome in part]


def closed_form(scene, sample=None):
    """Sticking speed of two single grains, or of one and a wall, head-on without damping [m/s].

    sqrt(2 x 0.77224 F_c delta0/m) with the reduced mass: what the potential of S12 loses when a
    contact forms and breaks. Of samples of more grains that of the first and the last.
    """
    contact = meeting(scene, samples.make(scene) if sample is None else sample)
    return sqrt(2.0 * JUMPS * contact.F_c * contact.delta0 / contact.mass)


def meeting(scene, sample):
    """ContactConstants of the first grain and the last, or of the first and a wall."""
    kinds, interaction = scene.all_materials, scene.interaction
    number = np.zeros(len(sample), int) if sample.materials is None else sample.materials
    ends = [
        (kinds[number[n]], kinds[number[n]].radius if sample.radii is None else sample.radii[n])
        for n in (0, -1)
    ]
    (a, r1), (b, r2) = ends
    if scene.boundary.walls:
        return glued(constants.wall_constants(a, interaction, r1, kinds[0]), scene.boundary)
    return constants.mixed_constants(a, r1, b, r2, interaction)


def rows(found):
    """Rows (what, value) of text of a Sticking."""
    lines = [
        ("sticking speed", f"{found.speed:.6g} ± {0.5 * (found.high - found.low):.1g} m/s"),
        ("two grains (or grain and wall), no damping", f"{found.closed:.6g} m/s"),
        ("time step", f"{found.time_step * 1e12:.4g} ps"),
        ("speeds tried", str(len(found.speeds))),
    ]
    if len(found.again):
        lines.append(("ended bound above it as well", ", ".join(f"{v:.4g}" for v in found.again)))
    return lines


def save_map(scene, text, directory, tolerance=1e-3, settings=()):
    """Write restitution.nc and restitution.png of the speeds "LOW,HIGH,COUNT" to a directory.

    settings: see `restitution_map`. Returns rows (what, value) of text, and the paths. Raises
    DustError.
    """
    from dusttaichi import plots

    data = restitution_map(scene, _speeds(text), tolerance, settings)
    closed = data.attrs["sticking_speed"]
    table = data.restitution.values.reshape(-1, data.sizes["speed"])
    axes = [data[name].values for name in data.restitution.dims[:-1]]
    labels = [
        ", ".join(f"{v:.4g}" if isinstance(v, float) else str(v) for v in point)
        for point in itertools.product(*axes)
    ]
    figure = plots.restitution(
        data.speed,
        table,
        closed if data.attrs["closed_form"] else None,
        [", ".join(data.restitution.dims[:-1]) + f" = {label}" for label in labels]
        if axes
        else scene.name,
    )
    paths = [Path(directory) / f"restitution{suffix}" for suffix in (".nc", ".png")]
    try:
        Path(directory).mkdir(parents=True, exist_ok=True)
        data.to_netcdf(paths[0])
        figure.savefig(paths[1])
    except OSError as error:
        raise DustError(f"The map cannot be written to {directory}: {error}.") from error
    apart = np.sort(np.broadcast_to(data.speed.values, data.bound.shape)[data.bound.values == 0])
    lines = [
        ("speeds", str(data.sizes["speed"])),
        ("slowest that does not end bound", f"{apart[0]:.6g} m/s" if len(apart) else "none"),
        ("two grains (or grain and wall), no damping", f"{closed:.6g} m/s"),
    ]
    return lines, paths


def speed_of(name, text):
    """The speed [m/s] of an option, None where it is not given. Raises DustError."""
    return None if text is None else quantities.parse(text, "speed", name)


def _speeds(text):
    parts = [part.strip() for part in text.split(",")]
    if len(parts) != 3 or not parts[2].isdigit() or int(parts[2]) < 2:
        raise DustError(
            f"--map {text}: two speeds and a number of at least 2 are needed, for example "
            '--map "0.01 m/s,5 m/s,40"'
        )
    low, high = (speed_of("--map", part) for part in parts[:2])
    if not 0.0 < low < high:
        raise DustError(f"--map {text}: speeds above 0 are needed, the second above the first")
    return np.geomspace(low, high, int(parts[2]))


class Collision:
    """A scene whose bodies fly at each other at any speed, everything else as it says.

    The step of single grains is shortened to what the tolerance asks for.
    """

    def __init__(self, scene, tolerance):
        if not 0.0 < tolerance < 1.0:
            raise DustError(f"--tolerance {tolerance:g}; allowed: a number between 0 and 1.")
        self.sample, self._rest, self._way = _motion(scene)
        self.closed = closed_form(scene, self.sample)
        own = chosen_step(scene, self.sample, bodies_of(scene, self.sample)).dt
        self.time = _stop_time(scene, own)
        if len(self.sample) <= 2:
            overlap = meeting(scene, self.sample).delta0
            own = min(own, LATEST * tolerance * overlap / self.closed)
            scene = scene.with_value("numerics.time_step", f"{own:.17g} s")
        self.scene, self.time_step = scene, own

    @property
    def is_closed(self):
        """True where the closed form holds."""
        head_on = not self.sample.info.get("impact_parameter")
        undamped = self.scene.interaction.damping.model == "none"
        return len(self.sample) <= 2 and undamped and head_on and not self.sample.spins.any()

    def at(self, speed):
        """The sample with its bodies at that relative speed [m/s]."""
        return replace(self.sample, velocities=self._rest + speed * self._way)

    def outcomes(self, speeds, others=None):
        """The batch.Outcome at each of the speeds [m/s], `time` after the slowest has touched.

        others: collisions of which all speeds are wanted, in this scene and with its step; by
        default this one.
        """
        members = others or [self]
        batch = build_batch(self.scene, [c.at(speed) for c in members for speed in speeds])
        self.time_step = batch.sim.dt * units.TIME  # that of the fastest
        flight = max(c.flight(batch, k * len(speeds)) for k, c in enumerate(members))
        batch.run_until(max(c.time for c in members) + flight / min(speeds))
        return batch.outcomes()

    def flight(self, batch, number=0):
        """Way of the relative flight until the first touch [m]; number: of its scene."""
        x, radius = self.sample.positions, self.scene.material.radius
        if self.sample.radii is not None:
            radius = float(self.sample.radii.min())  # on the safe side for larger ones
        box = batch.sim.box
        if box is None:
            split = batch.target_grains[number]
            one, other = x[None, :split, FLIGHT], x[None, split:, FLIGHT]
            flight = float(first_touch(one, other, 2.0 * radius)[0])
        else:
            way = self._way.mean(axis=0) @ box.normal.T
            above = (x @ box.normal.T).min(axis=0) - radius - box.offset * units.LENGTH
            ahead = (box.present == 1) & (way < 0.0)
            flight = float(np.min(above[ahead] / -way[ahead], initial=inf))
        if flight == inf:
            raise DustError("The bodies miss each other; try a smaller sample.impact_parameter.")
        return max(flight, 0.0)


def _motion(scene):
    """The sample, the velocities of its grains within the bodies, and those a unit of speed."""
    if scene.sample.kind in ("pair", "collision"):
        resting, moving = (
            samples.make(scene.with_value("sample.speed", speed)) for speed in ("0 m/s", "1 m/s")
        )
        return moving, resting.velocities, moving.velocities - resting.velocities
    if scene.sample.kind != "explicit" or not scene.boundary.walls:
        raise DustError(
            f"sample.kind = {scene.sample.kind}: a sticking speed is that of two bodies; allowed: "
            "pair, collision, or explicit grains that fly at a wall."
        )
    sample = samples.make(scene)
    mean = sample.velocities.mean(axis=0)
    speed = float(np.linalg.norm(mean))
    if speed == 0.0:
        raise DustError("sample.velocities: the grains rest; let them fly at the wall.")
    way = np.zeros_like(sample.velocities) + mean / speed
    return sample, sample.velocities - mean, way


def _stop_time(scene, dt):
    """How long a collision is followed after the touch [s]."""
    stop = scene.stop
    if stop is None or (stop.time is None and stop.steps is None):
        raise DustError("stop: a time or a number of steps is needed, for example {time: 1 us}")
    return min(stop.time or inf, (stop.steps or inf) * dt)
