"""Samples of the benchmarks, the same for us and for LAMMPS.

Up to a filling factor of 0.15 they are an RBD cake. A denser sample is a cake after compression by
a wall at 10 m/s, with a fifth of the critical damping. It then relaxes with the same damping
between walls at rest, twice, each time with new springs: both codes start from positions and
velocities with unloaded springs.

Above 30 000 grains a dense sample consists of copies of a compressed one of 11 000, side by side in
x and y, cut along x to the number of grains, and relaxed again. Its height, and so the share of
grains at the bottom and top wall, are those of the smaller one. This takes seconds, the compression
of 1e5 grains minutes.

Every grain has a random velocity of 1 cm/s rms: LAMMPS skips springs without motion.

Samples are stored in $XDG_CACHE_HOME/dusttaichi or ~/.cache/dusttaichi, named by a hash of
everything that they depend on.
"""

import hashlib
import json
import math
import os
import tempfile
import zipfile
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from dusttaichi import samples, units
from dusttaichi.compute.cache import cache_folder
from dusttaichi.physics.contact.constants import pair_constants
from dusttaichi.scene import Scene
from dusttaichi.studies.machine_speed import Timed

TASK = "benchmarks.task:answer"  # of the processes
MATERIAL = "silicate_s12"
MODIFIERS = {"rolling": 8.0, "sliding": 2.5}  # the modified model, S12 sect. 4.3
KAPPA = 1e-9  # damping while timed [kg/s], S12 sect. 2.1
TIME_STEP = 0.3e-9  # s
WALL_SPEED = 0.01  # of the top wall while timed [m/s]
THERMAL_SPEED = 0.01  # rms, m/s
PRESS_SPEED = 10.0  # m/s
PRESS_KAPPA = 3e-7  # kg/s; critical is 1.4e-6
SETTLE_STEPS, SETTLE_ROUNDS, SETTLE_TILED = 2000, 2, 1
TILED_ABOVE, TILE = 30_000, 11_000  # grains
CAKE = 0.15  # filling factor up to which a sample is the cake as it was deposited
VERSION = 1  # of the generation of samples; a change invalidates stored ones


@dataclass(frozen=True)
class Recipe:
    """Parameters of a benchmark sample."""

    grains: int
    filling_factor: float
    seed: int = 1

    @cached_property
    def path(self) -> Path:
        """File of the stored sample."""
        made_with = {
            **asdict(self),
            "version": VERSION,
            "material": bench_scene(self.grains).material.model_dump(mode="json"),
            "numbers": [
                *MODIFIERS.values(),
                TIME_STEP,
                THERMAL_SPEED,
                PRESS_SPEED,
                PRESS_KAPPA,
                SETTLE_STEPS,
                SETTLE_ROUNDS,
                SETTLE_TILED,
                TILED_ABOVE,
                TILE,
                CAKE,
            ],
        }
        digest = hashlib.sha256(json.dumps(made_with, sort_keys=True).encode()).hexdigest()
        return cache_folder() / f"bench_{self.grains}_{self.filling_factor:g}_{digest[:16]}.npz"


def bench_scene(
    grains: int,
    *,
    wall_speed: float = WALL_SPEED,
    kappa: float = KAPPA,
    threads: int | str = "auto",
    precision: str = "f64",
    seed: int = 1,
) -> Scene:
    """The scene of the benchmark: modified model, viscous damping [kg/s], six walls."""
    return Scene.from_dict(
        {
            "name": "bench",
            "material": MATERIAL,
            "interaction": {
                **{effect: {"modifier": factor} for effect, factor in MODIFIERS.items()},
                "damping": {"model": "viscous", "kappa": f"{kappa} kg/s"},
            },
            "sample": {"kind": "rbd", "grains": grains, "seed": seed},
            "boundary": {"kind": "box", "wall_speed": f"{wall_speed} m/s"},
            "stop": {"steps": 1},
            "numerics": {"time_step": f"{TIME_STEP} s", "threads": threads, "precision": precision},
        }
    )


def load(path: Path) -> samples.Sample | None:
    """A stored sample, or None without a readable file."""
    try:
        with np.load(path) as stored:
            positions, velocities = stored["positions"], stored["velocities"]
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
    return samples.Sample(positions, velocities, np.zeros_like(positions))


def prepare(recipe: Recipe, log, kernels: Path | None = None) -> None:
    """Make the sample of a recipe in a process of its own, unless it is stored."""
    if load(recipe.path) is None:
        log(f"{recipe.grains} grains: making them, filling factor {recipe.filling_factor:g}")
        with Timed(TASK, kernels) as process:
            process.call("prepare", grains=recipe.grains, filling_factor=recipe.filling_factor)


def make(recipe: Recipe) -> samples.Sample:
    """The sample of a recipe, stored if it is new. Starts Taichi unless it is a cake."""
    sample = load(recipe.path)
    if sample is None:
        positions = _generate_positions(recipe)
        sample = samples.Sample(
            positions, _draw_velocities(recipe, positions.shape), np.zeros_like(positions)
        )
        _store(recipe.path, positions=sample.positions, velocities=sample.velocities)
    return sample


def tile(positions, grains: int, pitch) -> np.ndarray:
    """Copies side by side in x and y, `pitch` (2,) apart, the first `grains` of them along x."""
    copies = math.ceil(grains / len(positions))
    across = math.ceil(math.sqrt(copies))
    rows = math.ceil(copies / across)
    shifts = [(a * pitch[0], b * pitch[1], 0.0) for a in range(across) for b in range(rows)]
    tile_sample = np.concatenate([positions + np.array(shift) for shift in shifts])
    return tile_sample[np.sort(np.argsort(tile_sample[:, 0], kind="stable")[:grains])]


def tile_sample(recipe: Recipe) -> np.ndarray:
    """Tile touching copies of the sample of TILE grains, not relaxed: positions (grains, 3) [m]."""
    scene = bench_scene(recipe.grains, seed=recipe.seed)
    base = make(Recipe(TILE, recipe.filling_factor, recipe.seed)).positions
    touch = 2 * scene.material.radius - pair_constants(scene.material, scene.interaction).delta0
    return tile(base, recipe.grains, np.ptp(base[:, :2], axis=0) + touch)


def _generate_positions(recipe: Recipe) -> np.ndarray:
    scene = bench_scene(recipe.grains, seed=recipe.seed)
    if recipe.filling_factor <= CAKE:
        return samples.make(scene).positions
    if recipe.grains > TILED_ABOVE:
        return _relax(tile_sample(recipe), SETTLE_TILED)
    return _relax(_compress(samples.make(scene), recipe.filling_factor), SETTLE_ROUNDS)


def _compress(cake, filling_factor: float) -> np.ndarray:
    """Compress a cake to a filling factor: positions [m]."""
    sim = _build(len(cake), cake, PRESS_SPEED)
    width, depth, height = sim.environment.lengths()
    volume = len(cake) * 4 / 3 * math.pi * sim.bodies.radius**3
    final = units.LENGTH * volume / (filling_factor * width * depth)
    height *= units.LENGTH
    sim.advance(max(1, round((height - final) / (PRESS_SPEED * TIME_STEP))))
    return _read_positions(sim)


def _relax(positions, rounds: int) -> np.ndarray:
    for _ in range(rounds):
        sim = _build(len(positions), samples.Sample.at_rest(positions), 0.0)
        sim.advance(SETTLE_STEPS)
        positions = _read_positions(sim)
    return positions


def _build(grains: int, sample, wall_speed: float):
    from dusttaichi.grains.build import build

    return build(bench_scene(grains, wall_speed=wall_speed, kappa=PRESS_KAPPA), sample)


def _read_positions(sim) -> np.ndarray:
    """Read positions [m] in the order of the sample."""
    positions = np.empty((sim.bodies.count, 3))
    positions[sim.grain_state.order] = sim.fields["x"].to_numpy()[: sim.bodies.count] * units.LENGTH
    return positions


def _draw_velocities(recipe: Recipe, shape) -> np.ndarray:
    """Draw velocities [m/s] without a mean."""
    rng = np.random.Generator(np.random.PCG64(recipe.seed))
    velocities = rng.normal(scale=THERMAL_SPEED / math.sqrt(3), size=shape)
    return velocities - velocities.mean(axis=0)


def _store(path: Path, **arrays) -> None:
    """Write a file atomically, since another benchmark may read it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".part", delete=False) as out:
        np.savez(out, **arrays)
    os.replace(out.name, path)
