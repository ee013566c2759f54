"""From a scene and a sample to a simulation: the one place that chooses what is compiled in."""

import os
from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from math import inf, pi

import numpy as np
import taichi as ti
from taichi.lang.impl import current_cfg

from dusttaichi import samples, units
from dusttaichi.domain.layout import make_surroundings
from dusttaichi.domain.pushes import make_push
from dusttaichi.domain.walls import glued, wall_strengths
from dusttaichi.errors import DustError
from dusttaichi.grains.compiled import Compiled, Kernels
from dusttaichi.grains.kernels import search, store
from dusttaichi.grains.kernels.cell import make_wrap
from dusttaichi.grains.kernels.measure import make_measure, place_measure
from dusttaichi.grains.kernels.memory import arrays_of
from dusttaichi.grains.kernels.params import contact_params
from dusttaichi.grains.kernels.polydisperse import (
    interface_table,
    make_write_constants,
    stored,
)
from dusttaichi.grains.kernels.reading import read_quickly
from dusttaichi.grains.kernels.wall_search import make_wall_relist
from dusttaichi.grains.motion import fastest
from dusttaichi.grains.simulation import Simulation, Typical
from dusttaichi.grains.state import GrainProperties
from dusttaichi.grains.step import make_advance
from dusttaichi.names import AXES
from dusttaichi.physics import encounter, stability
from dusttaichi.physics.contact import constants
from dusttaichi.physics.contact.registry import chosen_laws

THREAD_CLASSES = (32, 1024)  # that compiled kernels are made for
SMALL = 400  # grains below which a second thread costs more than it gains
BALANCED = 0.2  # step_fraction that physics.encounter is made for
RESOLVED = 0.005  # of the overlap at rest by which positions may be uncertain
SAFE = 1.4  # a step that strong damping limits may be this much nearer to its limit


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


def check_precision(scene, sample, delta0):
    """Raise DustError where single precision does not resolve overlaps; delta0 [m]: at rest."""
    resolved = 2.0**-24 * float(np.abs(sample.positions).max())
    if scene.numerics.precision == "f32" and resolved > RESOLVED * delta0:
        raise DustError(
            f"numerics.precision = f32: single precision knows the positions of this sample to "
            f"{resolved * 1e12:.2g} pm, and grains at rest overlap by {delta0 * 1e12:.3g} pm, of "
            f"which {RESOLVED:.1%} must be resolved; try mixed or f64, or a sample below "
            f"{RESOLVED * delta0 * 2.0**24 * 1e6:.2g} um about the origin"
        )


def threads_of(scene, grains):
    """Worker threads: all cores that this process may use, one for a small sample.

    Never more than there are cores: workers wait for each other.
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    if scene.numerics.threads != "auto":
        return min(scene.numerics.threads, cores)
    return 1 if grains < SMALL else max(1, min(cores, grains // (SMALL // 2)))


def moving(scene):
    """The scene with grains as heavy as they move: numerics.mass_scaling in their densities."""
    factor = scene.numerics.mass_scaling
    if factor == 1.0:
        return scene

    def heavier(material):
        return material.model_copy(update={"density": factor * material.density})

    return scene.model_copy(
        update={
            "material": heavier(scene.material),
            "materials": {name: heavier(m) for name, m in scene.materials.items()},
            "numerics": scene.numerics.model_copy(update={"mass_scaling": 1.0}),
        }
    )


def contact_constants(scene):
    """ContactConstants of two grains and of a grain and a wall of the scene."""
    scene = moving(scene)
    pair = constants.pair_constants(scene.material, scene.interaction)
    wall = constants.wall_constants(scene.material, scene.interaction)
    return pair, glued(wall, scene.boundary)


def bodies_of(scene, sample):
    """GrainProperties of a sample whose grains are not all alike; None where they are."""
    if sample.radii is None and sample.materials is None:
        return None
    scene = moving(scene)
    kinds = scene.all_materials
    number = np.zeros(len(sample), np.int32) if sample.materials is None else sample.materials
    radius = np.array([m.radius for m in kinds])[number] if sample.radii is None else sample.radii
    mass = constants.sphere_mass(radius, np.array([m.density for m in kinds])[number])
    return GrainProperties(
        radius / units.LENGTH,
        mass / units.MASS,
        0.4 * mass * radius**2 / units.INERTIA,
        number.astype(np.int32),
    )


def extremes(scene, bodies):
    """(material, smallest, largest radius [m]) of every material that the grains have."""
    radius, out = bodies.radius * units.LENGTH, []
    for number in np.unique(bodies.material):
        own = radius[bodies.material == number]
        out.append((scene.all_materials[number], float(own.min()), float(own.max())))
    return out


def farthest_contacts(scene, bodies):
    """ContactConstants of two grains and of a grain and a wall that hold on farthest."""
    kinds, interaction = extremes(scene, bodies), scene.interaction
    pairs = [
        constants.mixed_constants(a, r1, b, r2, interaction)
        for a, _, r1 in kinds
        for b, _, r2 in kinds
    ]
    walls = [constants.wall_constants(a, interaction, r, scene.material) for a, _, r in kinds]
    pair, wall = (max(some, key=lambda c: c.delta0) for some in (pairs, walls))
    return pair, glued(wall, scene.boundary)


def stiffest_of(scene, grains, bodies):
    """(shortest period [s], highest damping rate [1/s]), see physics.stability.

    Where grains are not all alike each cluster is one of grains of the smallest radius of a
    material, all with the springs of such a grain's contact with the largest grain of each
    material. That is on the safe side (by a quarter for small grains among very large ones), as
    springs grow with the size of the partner and frequencies fall with the mass.
    """
    found = [
        stability.stiffest(mass, pair, wall, grains, wall_strengths(scene.boundary))
        for mass, pair, wall in arrangements(scene, bodies)
    ]
    return min(period for period, _ in found), max(rate for _, rate in found)


def arrangements(scene, bodies):
    """(mass [kg], ContactConstants of a pair, of a wall) of the clusters of `stiffest_of`."""
    scene = moving(scene)
    if bodies is None:
        return [(constants.grain_mass(scene.material), *contact_constants(scene))]
    found, kinds = [], extremes(scene, bodies)
    for a, small, _ in kinds:
        wall = constants.wall_constants(a, scene.interaction, small, scene.material)
        mass = constants.sphere_mass(small, a.density)
        for b, _, large in kinds:
            pair = constants.mixed_constants(a, small, b, large, scene.interaction)
            found.append((mass, pair, glued(wall, scene.boundary)))
    return found


def meetings(scene, bodies):
    """ContactConstants of two grains and of a grain and a wall, (list, list): the ends of the radii
    of every two materials."""
    if bodies is None:
        pair, wall = contact_constants(scene)
        return [pair], [wall]
    scene = moving(scene)
    ends = [(m, r) for m, *radii in extremes(scene, bodies) for r in sorted(set(radii))]
    pairs = [
        constants.mixed_constants(a, r1, b, r2, scene.interaction)
        for a, r1 in ends
        for b, r2 in ends
    ]
    walls = [constants.wall_constants(a, scene.interaction, r, scene.material) for a, r in ends]
    return pairs, [glued(wall, scene.boundary) for wall in walls]


def step_of_motion(scene, bodies, motion):
    """Longest step [s] that resolves how fast bodies meet and turn; see physics.encounter."""
    pairs, walls = meetings(scene, bodies)
    found = [encounter.step(c, motion.grains, motion.alone) for c in pairs]
    if scene.boundary.walls:
        found += [encounter.step(c, motion.walls, motion.alone) for c in walls]
    return min(*found, encounter.TURN / motion.spin if motion.spin > 0.0 else inf)


@dataclass(frozen=True)
class TimeStep:
    """The step [s], the stiffest period it is measured by, the largest stable one, and the longest
    that resolves how fast bodies meet and turn."""

    dt: float
    period: float
    limit: float
    resolved: float = inf


def time_step(scene, grains, bodies=None, motion=None):
    """The step of a scene of `grains` grains; bodies: GrainProperties where they are not all alike.

    motion: Motion of the sample; without it nothing moves fast. `auto` is step_fraction of the
    stiffest period, or less where fast bodies need it.
    Raises DustError when the step asked for cannot be stable.
    """
    period, rate = stiffest_of(scene, grains, bodies)
    limit = stability.largest_stable_step(period, rate)
    resolved = inf if motion is None else step_of_motion(scene, bodies, motion)
    if scene.numerics.time_step == "auto":
        if not np.isfinite(period):
            raise DustError(
                "numerics.time_step = auto: one free grain has no period to take the step from; "
                'give a step, for example "0.3 ns"'
            )
        fraction = scene.numerics.step_fraction
        resolved *= min(1.0, fraction / BALANCED)
        dt = min(fraction * period, fraction * pi * limit * SAFE, resolved)
        return TimeStep(dt, period, limit, resolved)
    dt = scene.numerics.time_step
    if rate > 0.0 and dt >= limit:
        limit = min(
            stability.damped_limit(mass, pair, wall, grains, wall_strengths(scene.boundary))
            for mass, pair, wall in arrangements(scene, bodies)
        )
    if dt >= limit:
        raise DustError(
            f'numerics.time_step = "{dt * 1e9:.4g} ns": not stable. The stiffest period of this '
            f"scene is {period * 1e9:.4g} ns and the leapfrog needs less than "
            f'{limit * 1e9:.4g} ns with this damping; try "auto", or {0.6 * limit * 1e9:.3g} ns'
        )
    return TimeStep(dt, period, limit, resolved)


def chosen_step(scene, sample, bodies=None, scenes=None):
    """The TimeStep that a scene takes with a sample (pushed); scenes: of a batch, see `build`."""
    most = len(sample.positions) if scenes is None else int(np.bincount(scenes).max())
    radii = scene.material.radius if bodies is None else bodies.radius * units.LENGTH
    return time_step(scene, most, bodies, fastest(scene, sample, radii, scenes))


def start_taichi(scene, threads):
    """Initialise Taichi for this scene, quietly, with the kernels cached on disk."""
    read_quickly()
    arch = {"cpu": ti.cpu, "cuda": ti.cuda}[scene.numerics.backend]
    os.environ.setdefault("TI_OFFLINE_CACHE_CLEANING_POLICY", "lru")
    try:
        # Taichi prints where it starts; the output of a run belongs to the user
        with redirect_stdout(StringIO()):
            ti.init(
                arch=arch,
                cpu_max_num_threads=threads,
                # what a number written in a kernel is: it must not make doubles of single lanes
                default_fp=ti.f64 if scene.numerics.precision == "f64" else ti.f32,
                fast_math=True,
                offline_cache=True,
                log_level=ti.ERROR,
                enable_fallback=False,
            )
        # `threads` of them are started; that kernels may ask for more makes them the same for all
        current_cfg().cpu_max_num_threads = next(
            (n for n in THREAD_CLASSES if n >= threads), threads
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


def build(scene, sample, drive=None, scenes=None, ledger=True, step=None, like=None):
    """Simulation of a scene with a sample (dusttaichi.samples.Sample), contacts found, loads set.

    drive: a Drive other than that of the backend, to compare them.
    scenes: of a batch (dusttaichi.grains.batch), the number of the scene of each grain, rising.
    ledger: False leaves the losses out, to measure what they cost.
    step: a TimeStep to take whatever the scene says, stable or not.
    like: a Simulation, built last and of no more use, whose fields and kernels serve again where
    only numbers differ.
    Raises DustError for a sample that does not fit, or a step that cannot be stable.
    """
    sample = samples.pushed(scene, sample)
    material, scene = scene.material, moving(scene)
    grains = len(sample.positions)
    alone = slice(None) if scenes is None else scenes == 0  # walls stand around the first scene
    bodies = bodies_of(scene, sample)
    check_precision(scene, sample, contact_constants(scene)[0].delta0)
    step = step or chosen_step(scene, sample, bodies, scenes)
    positions = sample.positions / units.LENGTH
    typical = scene.material.radius / units.LENGTH
    if bodies is not None:
        typical = float(np.median(bodies.radius))
    if scenes is None:
        order = spatial_order(positions, 4.0 * typical)
    else:
        order = batch_order(positions, 4.0 * typical, scenes)
    push = make_push(scene.push, sample.info, order, step.dt / units.TIME)
    threads = threads_of(scene, grains)
    laws = chosen_laws(scene.interaction, scene.numerics.newton_steps)
    walls = bool(scene.boundary.walls)
    drive = drive or DRIVES[scene.numerics.backend]
    periodic = tuple(AXES.index(axis) for axis in scene.boundary.periodic_axes)
    layout = store.Layout(
        drive.width,
        drive.tile,
        laws.twisting is not None,
        laws.damping is not None,
        periodic,
        scene.output.stress,
        laws.asperities is not None,
        push.forced,
        push.carried,
        scenes is not None,
        stored(laws) if bodies is not None else (),
        scene.numerics.precision,
        ledger,
    )
    compile_key = (
        scene.numerics.backend,
        threads,
        store.room_for(grains),
        layout,
        laws,
        walls,
        drive.kind,
        len(scene.all_materials),
    )
    if like is not None and like.compiled.compile_key == compile_key:
        compiled = like.compiled
    else:
        start_taichi(scene, threads)
        compiled = compile_parts(scene, layout, laws, grains, walls, drive, compile_key)
    fields, scratch, sums = tables = compiled.tables(grains)
    if bodies is not None:
        scratch["interfaces"].from_numpy(interfaces(scene, laws))
    if bodies is None:
        pair, wall = contact_constants(scene)
        radius, overlap = typical, wall.delta0 / units.LENGTH
    else:
        pair, wall = farthest_contacts(scene, bodies)
        radius, overlap = bodies.radius[alone], wall_overlaps(scene, bodies)[alone]
    period = sample.info.get("period")
    box, cell = make_surroundings(
        scene.boundary,
        positions[alone],
        radius,
        contact=2.0 * radius - pair.delta0 / units.LENGTH,
        overlap=overlap,
        period=None if period is None else np.array(period) / units.LENGTH,
    )
    if scenes is not None:
        fields["scene"].from_numpy(scenes[order].astype(np.int32))
    return Simulation(
        compiled,
        tables,
        sample,
        order=order,
        box=box,
        cell=cell,
        t_c=constants.characteristic_time(material) / units.TIME,
        push=push,
        drive=scene.stage_plans[0].drive,
        pair=contact_params(pair, laws, layout),
        wall=contact_params(wall, laws, layout),
        typical=Typical(
            typical,
            constants.grain_mass(scene.material) / units.MASS,
            constants.moment_of_inertia(scene.material) / units.INERTIA,
        ),
        skin=None if scene.numerics.skin == "auto" else scene.numerics.skin * np.min(radius),
        dt=step.dt / units.TIME,
        threads=threads,
        scenes=1 if scenes is None else int(scenes[-1]) + 1,
        polydisperse=bodies,
    )


def compile_parts(scene, layout, laws, grains, walls, drive, compile_key):
    """The Compiled of a scene: all that does not hang on its numbers, nor on that of grains
    but for the room they need."""
    room = store.room_for(grains)
    fields = store.place(store.declare(room, layout, walls))
    scratch = search.place_search(room, layout, walls)
    sums = place_measure(room, layout, walls)
    write = place_interfaces(scene, laws, fields, scratch) if layout.polydisperse else None
    relist, list_entries = search.make_relist(fields, scratch, layout, write)
    periodic = bool(layout.periodic)
    kernels = Kernels(
        advance=make_advance(fields, layout, laws, walls, drive.kind),
        bounds=search.make_bounds(fields, scratch),
        find=search.make_find(fields, scratch, layout),
        relist=relist,
        list_entries=list_entries,
        relist_walls=make_wall_relist(fields, scratch, layout, write) if walls else None,
        wrap=make_wrap(fields, layout, walls) if periodic else None,
        measure=make_measure(fields, sums, layout, laws, walls),
    )
    together = {**fields, **scratch, **sums}
    shared = scene.numerics.backend == "cpu"
    memory = arrays_of(together) if shared else {}
    return Compiled(compile_key, layout, walls, kernels, fields, scratch, sums, memory)


def wall_overlaps(scene, bodies):
    """Overlap of each grain in equilibrium with a wall [um], (N,)."""
    kinds = scene.all_materials
    alike = {
        key: constants.wall_constants(
            kinds[key[1]], scene.interaction, key[0] * units.LENGTH, scene.material
        ).delta0
        / units.LENGTH
        for key in set(zip(bodies.radius.tolist(), bodies.material.tolist(), strict=True))
    }
    return np.array(
        [alike[key] for key in zip(bodies.radius.tolist(), bodies.material.tolist(), strict=True)]
    )


def place_interfaces(scene, laws, fields, scratch):
    """The table of interfaces in a field; returns what writes the numbers of contacts."""
    table = scratch["interfaces"] = ti.field(ti.f64, shape=interfaces(scene, laws).shape)
    return make_write_constants(fields, table, scene, laws)


def interfaces(scene, laws):
    """Rows of the table of interfaces (kernels.polydisperse)."""
    glue = scene.boundary.glue if scene.boundary.kind == "plates" else 1.0
    return interface_table(scene, laws, glue)
