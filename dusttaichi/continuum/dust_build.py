"""From a scene and its particles to an engine: the one place that chooses what is compiled."""

import numpy as np

from dusttaichi.compute.backend import loops_of, threads_of
from dusttaichi.compute.compiled import STRUCTURES
from dusttaichi.compute.memory import capacity_for
from dusttaichi.continuum.compiled_dust import compiled_for
from dusttaichi.continuum.dust_engine import PREFIX, DustEngine
from dusttaichi.continuum.dust_forces import shortest_timescale
from dusttaichi.continuum.dust_placement import domain_of, faces_of, find_surfaces, stiff_faces
from dusttaichi.continuum.dust_setup import Prepared
from dusttaichi.continuum.kernel_numbers import numbers_of, periods, self_gravity
from dusttaichi.continuum.kernels.store import (
    BODIES,
    DENSEST,
    LANES,
    LONGEST_LIST,
    OF_BLOCK,
    Layout,
)
from dusttaichi.continuum.particle_search import SKIN, SUPPORT, way2_of
from dusttaichi.continuum.physics.dust_laws import laws_of
from dusttaichi.continuum.physics.material_numbers import MaterialNumbers
from dusttaichi.continuum.samples.particle_arrays import ARRAYS, Body, Particles
from dusttaichi.errors import DustError
from dusttaichi.physics.forces.model import ForceModel
from dusttaichi.physics.geometry import AXES
from dusttaichi.results.plain import from_plain
from dusttaichi.results.roles import DUST
from dusttaichi.scene.forces import find_law


def build(scene, sample, *, loops=None):
    """DustEngine of a scene with its Particles at step 0, stresses and forces computed.

    loops: backend.Loops other than those of the backend, to compare them.
    Raises DustError for more rigid bodies than BODIES.
    """
    preparation = prepare(scene, sample, loops=loops)
    compiled = choose_kernels(preparation)
    return DustEngine(scene, preparation, compiled, STRUCTURES.tables(compiled, {}))


def make(scene, sample):
    """DustEngine of a scene and its Particles, at step 0."""
    return build(scene, sample)


def reopen(scene, state):
    """DustEngine in a State of a continuum of that scene."""
    stored = state.numbers["sample"]
    bodies = tuple(from_plain(Body, body) for body in stored["bodies"])
    arrays = {name: state.arrays[PREFIX + name] for name in (*ARRAYS, "body", "room")}
    further = {name: stored[name] for name in ("spacing", "dimension", "info")}
    engine = make(scene, Particles(**arrays, **further, bodies=bodies))
    engine.restore(state)
    return engine


def prepare(scene, sample, *, loops=None):
    """Prepared of a scene with its Particles; nothing is compiled. Arguments, errors as `build`."""
    bodies = sum(body.rigid for body in sample.bodies)
    if bodies > BODIES:
        raise DustError(f"sample: {bodies} rigid bodies; allowed: {BODIES} at most.")
    execution = (loops or loops_of(scene.numerics)).execution
    dimension, smoothing_length = scene.dimension, scene.numerics.smoothing_length
    surfaces = find_surfaces(scene, sample, bodies)
    further = {
        "count": len(sample),
        "bodies": bodies,
        "way2": way2_of(dimension, smoothing_length),
        "longest": scene.numerics.cfl * shortest_timescale(scene, sample),
    }
    return Prepared(
        scene,
        sample,
        bodies,
        numbers=numbers_of(scene) | periods(surfaces.edges, dimension) | further,
        materials=MaterialNumbers.together(scene.all_materials),
        domain=domain_of(scene, sample, 1.0),
        surfaces=surfaces,
        threads=threads_of(scene, len(sample)),
        execution=execution,
        layout=layout_of(scene, execution),
    )


def layout_of(scene, execution="workers"):
    """Layout of the kernels of a scene; execution: of the loops (backend.Loops)."""
    numerics, boundary = scene.numerics, scene.boundary
    return Layout(
        dimension=scene.dimension,
        kernel=numerics.kernel,
        ghosts=bool(boundary.periodic_axes or faces_of(boundary, "mirrors")),
        faces=bool(stiff_faces(boundary)),
        bodies=scene.sample.has_rigid,
        separate=numerics.contact == "separate",
        viscous=numerics.viscosity.by_pairs,
        artificial_stress=numerics.artificial_stress is not None,
        hourglass=scene.resists_hourglass,
        self_gravity=self_gravity(scene) is not None,
        heat=scene.material.heat_capacity is not None,
        damage=any(material.damage for material in scene.all_materials),
        materials=bool(scene.materials),
        laws=laws_of(scene.all_materials),
        lanes=LANES if execution == "workers" else 1,
        forces=ForceModel(tuple(find_law(block) for block in scene.forces)),
    )


def choose_kernels(preparation):
    """The Compiled of a Prepared."""
    scene, layout, numerics = preparation.scene, preparation.layout, preparation.scene.numerics
    room = capacity_for(len(preparation.sample))
    entries = int(room * longest_list(preparation))
    ghosts = capacity_for(ghost_count(scene, preparation.sample)) if layout.ghosts else 0
    capacity, threads = (room, entries, ghosts), preparation.threads
    key = (
        "continuum",
        numerics.backend,
        numerics.debug,
        layout,
        capacity,
        threads,
        preparation.execution,
    )
    return STRUCTURES.get(key, scene, threads, lambda key: compiled_for(key, layout, capacity))


def longest_list(preparation):
    """Capacity in list entries for each particle of a Prepared, on average."""
    scene, sample, materials = preparation.scene, preparation.sample, preparation.materials
    dust = sample.role == DUST
    densest = (materials.phi_2 * materials.rho_s)[sample.material[dust]] / sample.density[dust]
    compaction = np.ceil(densest.mean() / DENSEST) if dust.any() else 1.0
    crowd = (scene.numerics.h_over_spacing / 1.3) ** scene.dimension
    out = LONGEST_LIST[scene.dimension] * max(1.0, crowd) * max(1.0, compaction)
    lanes = preparation.layout.lanes
    return out if lanes == 1 else out * OF_BLOCK / lanes


def ghost_count(scene, particles):
    """Capacity for images beyond mirrors and periodic faces.

    1.5 times as many as an even filling has.
    """
    smoothing_length = scene.numerics.smoothing_length
    reach, boundary = (SUPPORT + SKIN[scene.dimension]) * smoothing_length, scene.boundary
    x, ghost_fraction = particles.position, 1.0
    mirrors = [face // 2 for face in faces_of(boundary, "mirrors")]
    repeating = [AXES.index(name) for name in boundary.periodic_axes]
    for axis in (*mirrors, *repeating):
        extent = np.ptp(x[:, axis]) + particles.spacing
        ghost_fraction *= 1.0 + (2.0 if axis in repeating else 1.0) * min(1.0, reach / extent)
    return int(1.5 * (ghost_fraction - 1.0) * len(x)) + 1
