"""From a scene and a sample to a simulation: the one place that chooses what is compiled in."""

import os
from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from math import pi

import numpy as np
import taichi as ti

from dusttaichi import samples, units
from dusttaichi.errors import DustError
from dusttaichi.kernels import search, store
from dusttaichi.kernels.cell import make_wrap
from dusttaichi.kernels.measure import make_measure, place_measure
from dusttaichi.kernels.params import contact_params
from dusttaichi.kernels.wall_search import make_wall_relist
from dusttaichi.physics import constants, damping, stability
from dusttaichi.push import make_push
from dusttaichi.scene import AXES
from dusttaichi.simulation import Kernels, Simulation
from dusttaichi.step import make_advance
from dusttaichi.surroundings import glued, make_surroundings, wall_strengths

SMALL = 400  # grains below which a second thread costs more than it gains
SAFE = 1.4  # a step that strong damping limits may be this much nearer to its limit


@dataclass(frozen=True)
class Effects:
    """What the contact passes are made of."""

    rolling: bool
    sliding: bool
    twisting: bool
    damping: object  # function of physics.damping, or None
    asperities: bool

    @property
    def damped(self):
        return self.damping is not None


def chosen_effects(interaction):
    """The effects that a scene asks for."""
    return Effects(
        rolling=interaction.rolling is not None,
        sliding=interaction.sliding is not None,
        twisting=interaction.twisting is not None,
        damping=damping.COEFFICIENT.get(interaction.damping.model),
        asperities=interaction.asperities is not None,
    )


@dataclass(frozen=True)
class Drive:
    """How the loops are laid out: lanes of a block, blocks of a tile, and what runs the steps.

    Eight doubles fill a wide vector register; a GPU thread takes one contact, and there a kernel
    a phase takes the place of workers that wait for each other.
    """

    width: int
    tile: int
    kind: str


DRIVES = {"cpu": Drive(8, 16, "workers"), "cuda": Drive(1, 1, "launches")}


def threads_of(scene, grains):
    """Worker threads: all cores that this process may use, one for a small sample.

    Never more than there are cores: workers wait for each other.
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    if scene.numerics.threads != "auto":
        return min(scene.numerics.threads, cores)
    return 1 if grains < SMALL else max(1, min(cores, grains // (SMALL // 2)))


def contact_constants(scene):
    """ContactConstants of two grains and of a grain and a wall of the scene."""
    pair = constants.pair_constants(scene.material, scene.interaction)
    wall = constants.wall_constants(scene.material, scene.interaction)
    return pair, glued(wall, scene.boundary)


@dataclass(frozen=True)
class TimeStep:
    """The step [s], the stiffest period it is measured by, and the largest stable one."""

    dt: float
    period: float
    limit: float


def time_step(scene, grains):
    """The step of a scene of `grains` grains.

    Raises DustError when the step asked for cannot be stable.
    """
    pair, wall = contact_constants(scene)
    period, rate = stability.stiffest(
        constants.grain_mass(scene.material), pair, wall, grains, wall_strengths(scene.boundary)
    )
    limit = stability.largest_stable_step(period, rate)
    if scene.numerics.time_step == "auto":
        if not np.isfinite(period):
            raise DustError(
                "numerics.time_step = auto: one free grain has no period to take the step from; "
                'give a step, for example "0.3 ns"'
            )
        fraction = scene.numerics.step_fraction
        return TimeStep(min(fraction * period, fraction * pi * limit * SAFE), period, limit)
    dt = scene.numerics.time_step
    if dt >= limit:
        raise DustError(
            f'numerics.time_step = "{dt * 1e9:.4g} ns": not stable. The stiffest period of this '
            f"scene is {period * 1e9:.4g} ns and the leapfrog needs less than "
            f'{limit * 1e9:.4g} ns with this damping; try "auto", or {0.6 * limit * 1e9:.3g} ns'
        )
    return TimeStep(dt, period, limit)


def start_taichi(scene, threads):
    """Initialise Taichi for this scene, quietly, with the kernels cached on disk."""
    arch = {"cpu": ti.cpu, "cuda": ti.cuda}[scene.numerics.backend]
    os.environ.setdefault("TI_OFFLINE_CACHE_CLEANING_POLICY", "lru")
    try:
        # Taichi prints where it starts; the output of a run belongs to the user
        with redirect_stdout(StringIO()):
            ti.init(
                arch=arch,
                cpu_max_num_threads=threads,
                default_fp=ti.f64,
                fast_math=True,
                offline_cache=True,
                log_level=ti.ERROR,
                enable_fallback=False,
            )
    except Exception as error:
        raise DustError(
            f"numerics.backend = {scene.numerics.backend}: Taichi cannot start it here "
            f"({str(error).splitlines()[0]}); try backend: cpu"
        ) from error


def spatial_order(positions, cell):
    """Order of grains along a Morton curve of cells, so that neighbours stand close in memory."""
    c = np.floor((positions - positions.min(axis=0)) / cell).astype(np.int64)
    key = np.zeros(len(c), np.int64)
    for bit in range(20):
        for axis in range(3):
            key |= ((c[:, axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(key, kind="stable")


def batch_order(positions, cell, scenes):
    """Scene after scene, each in the spatial order that it would have alone."""
    members = [np.flatnonzero(scenes == n) for n in range(scenes[-1] + 1)]
    return np.concatenate([own[spatial_order(positions[own], cell)] for own in members])


def build(scene, sample, drive=None, scenes=None):
    """Simulation of a scene with a sample (dusttaichi.samples.Sample), contacts found, loads set.

    drive: a Drive other than that of the backend, to compare them.
    scenes: of a batch (dusttaichi.batch), the number of the scene that each grain is in, rising.
    Raises DustError for a sample that does not fit, or a step that cannot be stable.
    """
    sample = samples.pushed(scene, sample)
    grains = len(sample.positions)
    alone = slice(None) if scenes is None else scenes == 0  # walls stand around the first scene
    step = time_step(scene, grains if scenes is None else int(np.bincount(scenes).max()))
    cell_size = 4.0 * scene.material.radius / units.LENGTH
    positions = sample.positions / units.LENGTH
    if scenes is None:
        order = spatial_order(positions, cell_size)
    else:
        order = batch_order(positions, cell_size, scenes)
    push = make_push(scene.push, sample.info, order, step.dt / units.TIME)
    threads = threads_of(scene, grains)
    start_taichi(scene, threads)
    effects = chosen_effects(scene.interaction)
    walls = bool(scene.boundary.walls)
    drive = drive or DRIVES[scene.numerics.backend]
    periodic = tuple(AXES.index(axis) for axis in scene.boundary.periodic_axes)
    layout = store.Layout(drive.width, drive.tile, effects.twisting, effects.damped, periodic,
                          scene.output.stress, effects.asperities, push.forced, push.carried,
                          scenes is not None)  # fmt: skip
    fields = store.place(store.declare(grains, layout, walls))
    scratch = search.place_search(grains, layout, walls)
    sums = place_measure(grains, layout, walls)
    relist, list_entries = search.make_relist(fields, scratch, layout, grains, walls)
    kernels = Kernels(
        advance=make_advance(fields, layout, effects, grains, walls, drive.kind),
        bounds=search.make_bounds(fields, scratch, grains),
        find=search.make_find(fields, scratch, layout, grains, walls),
        relist=relist,
        list_entries=list_entries,
        relist_walls=make_wall_relist(fields, scratch, layout, grains) if walls else None,
        wrap=make_wrap(fields, layout, grains, store.CHUNK) if periodic else None,
        measure=make_measure(fields, sums, layout, effects, grains, walls),
    )
    pair, wall = contact_constants(scene)
    radius = scene.material.radius / units.LENGTH
    period = sample.info.get("period")
    box, cell = make_surroundings(
        scene.boundary, positions[alone], radius, 2.0 * radius - pair.delta0 / units.LENGTH,
        wall.delta0 / units.LENGTH, None if period is None else np.array(period) / units.LENGTH,
    )  # fmt: skip
    if scenes is not None:
        fields["scene"].from_numpy(scenes[order].astype(np.int32))
    return Simulation(
        fields=fields,
        scratch=scratch,
        sums=sums,
        kernels=kernels,
        layout=layout,
        sample=sample,
        order=order,
        box=box,
        cell=cell,
        push=push,
        material=scene.material,
        drive=scene.legs[0].drive,
        pair=contact_params(pair),
        wall=contact_params(wall, walls=True),
        mass=constants.grain_mass(scene.material) / units.MASS,
        inertia=constants.moment_of_inertia(scene.material) / units.INERTIA,
        radius=radius,
        skin=None if scene.numerics.skin == "auto" else scene.numerics.skin * radius,
        dt=step.dt / units.TIME,
        threads=threads,
        scenes=1 if scenes is None else int(scenes[-1]) + 1,
    )
