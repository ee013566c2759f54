"""From a scene and its particles to a simulation: the one place that chooses what is compiled."""

import numpy as np

from dusttaichi.compute.backend import loops_of, threads_of
from dusttaichi.compute.compiled import STRUCTURES
from dusttaichi.compute.memory import capacity_for
from dusttaichi.continuum import time_step
from dusttaichi.continuum.compiled_dust import compiled_for
from dusttaichi.continuum.kernels import smoothing
from dusttaichi.continuum.kernels.separation import CLOSED
from dusttaichi.continuum.kernels.store import (
    BODIES,
    COLUMN,
    DT,
    FACES,
    LANES,
    LEFT,
    LONGEST_LIST,
    WANT,
    Layout,
)
from dusttaichi.continuum.outside import put_forces, shortest_timescale
from dusttaichi.continuum.particle_search import SKIN, SUPPORT, Search
from dusttaichi.continuum.physics.dust_laws import laws_of
from dusttaichi.continuum.physics.elasticity import bulk_modulus
from dusttaichi.continuum.physics.material_numbers import MaterialNumbers
from dusttaichi.continuum.samples.flaws import flaws_of
from dusttaichi.continuum.simulation import Simulation, body_row
from dusttaichi.domain.cell import Cell
from dusttaichi.domain.domain import Domain
from dusttaichi.domain.walls import NORMALS, Box
from dusttaichi.errors import DustError
from dusttaichi.physics.forces.model import ForceModel
from dusttaichi.physics.geometry import AXES, WALLS
from dusttaichi.results.roles import DUST, ELASTIC, RIGID
from dusttaichi.scene.forces import find_law

DEPTH = 1.0  # [m] of a scene in two dimensions: forces and energies are per metre


def build(scene, particles, *, loops=None):
    """Simulation of a scene with its Particles at step 0, stresses and forces computed.

    loops: backend.Loops other than those of the backend, to compare them.
    Raises DustError for more rigid bodies than BODIES.
    """
    moving = [body for body in particles.bodies if body.rigid]
    if len(moving) > BODIES:
        raise DustError(f"sample: {len(moving)} rigid bodies; allowed: {BODIES} at most.")
    threads, n = threads_of(scene, len(particles)), len(particles)
    execution = (loops or loops_of(scene.numerics)).execution
    compiled = chosen_kernels(scene, particles, threads, execution)
    mirrors, edges = surfaces(scene, particles)
    sim = Simulation(
        compiled,
        STRUCTURES.tables(compiled, {}),
        n,
        numbers=numbers_of(scene, compiled.layout.dimension) | periods(edges, scene.dimension),
        materials=MaterialNumbers.together(scene.all_materials),
        output_step=1.0,
        threads=threads,
        bodies=len(moving),
    )
    for name in ("sync", "most"):
        sim.lists[name].fill(0)
    if compiled.layout.materials:
        sim.lists["materials"].from_numpy(np.stack(sim.materials.values(), axis=1))
    # rows of `rigid` that have a surface
    rigid = *stiff_faces(scene.boundary), *range(FACES, FACES + len(moving))
    sim.search = Search(sim, scene.numerics.smoothing_length, mirrors, edges, rigid)
    put_particles(sim, particles, moving, faces_of(scene.boundary, "mirrors"))
    put_options(sim, particles, scene)
    put_forces(sim, particles, scene)
    sim.numbers["longest"] = scene.numerics.cfl * shortest_timescale(scene, particles)
    sim.search.update()
    sim.load_once()
    begin(sim, scene)
    return sim


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


def self_gravity(scene):
    """The block of the self-gravity of a scene, or None."""
    return scene.gravity.self_gravity if scene.gravity else None


def chosen_kernels(scene, particles, threads, execution):
    """The Compiled of a scene with its particles, with loops of that kind."""
    layout, numerics = layout_of(scene, execution), scene.numerics
    room = capacity_for(len(particles))
    crowd = (numerics.h_over_spacing / 1.3) ** scene.dimension
    entries = int(room * LONGEST_LIST[scene.dimension] * max(1.0, crowd))
    capacity = room, entries, capacity_for(ghost_count(scene, particles)) if layout.ghosts else 0
    key = ("continuum", numerics.backend, numerics.debug, layout, capacity, threads, execution)
    return STRUCTURES.get(key, scene, threads, lambda key: compiled_for(key, layout, capacity))


def ghost_count(scene, particles):
    """Capacity for images beyond mirrors and periodic faces.

    1.5 times as many as an even filling has.
    """
    h = scene.numerics.smoothing_length
    reach, boundary = (SUPPORT + SKIN[scene.dimension]) * h, scene.boundary
    x, ghost_fraction = particles.position, 1.0
    mirrors = [face // 2 for face in faces_of(boundary, "mirrors")]
    repeating = [AXES.index(name) for name in boundary.periodic_axes]
    for axis in (*mirrors, *repeating):
        extent = np.ptp(x[:, axis]) + particles.spacing
        ghost_fraction *= 1.0 + (2.0 if axis in repeating else 1.0) * min(1.0, reach / extent)
    return int(1.5 * (ghost_fraction - 1.0) * len(x)) + 1


def numbers_of(scene, dimension):
    """Arguments of the kernels that are constant over a run, as a dict."""
    numerics, h = scene.numerics, scene.numerics.smoothing_length
    stress = numerics.artificial_stress
    gravity_numbers = self_gravity(scene)
    x, y, z = (scene.gravity and scene.gravity.acceleration) or (0.0, 0.0, 0.0)
    at_spacing = smoothing.SHAPES[numerics.kernel](numerics.spacing / h)
    printed = numerics.deviator == "printed" and dimension == 2
    return {
        "h": h,
        "inv_h": 1.0 / h,
        "scale": smoothing.scale(numerics.kernel, dimension, h),
        "courant": numerics.cfl,
        "contact": numerics.viscosity.contact,
        "bulk": numerics.viscosity.bulk,
        "quadratic": numerics.viscosity.quadratic,
        "grid": numerics.viscosity.grid,
        "limiter": float(numerics.viscosity.limiter == "balsara"),
        "share": 1.0 / 2.0 if printed else 1.0 / 3.0,
        "over_return": float(numerics.plastic_return == "benz"),
        "tension": 0.0 if stress is None else stress.epsilon,
        "exponent": 1.0 if stress is None else stress.n,
        "at_spacing": 1.0 / at_spacing,
        "hourglass": numerics.hourglass,
        "longest": np.inf,
        "gravity": [x, z] if dimension == 2 else [x, y, z],
        "attraction": 0.0 if gravity_numbers is None else gravity_numbers.constant,
        "soft2": h * h
        if gravity_numbers is None or gravity_numbers.softening == "auto"
        else gravity_numbers.softening**2,
    }


def surfaces(scene, particles):
    """(axis, side, plane) of the mirrors and (axis, low, high) of the periodic faces.

    In the axes of the kernels [m].
    """
    axes, boundary = list(particles.axes), scene.boundary
    faces = faces_of(boundary, "mirrors")
    mirrors = [(axes.index(k // 2), k % 2, float(particles.room[k // 2, k % 2])) for k in faces]
    periodic = [AXES.index(axis) for axis in boundary.periodic_axes]
    return mirrors, [(axes.index(k), *map(float, particles.room[k])) for k in periodic]


def periods(edges, dimension):
    """Lengths of the axes of the kernels that repeat [m], and one over them; 0 of the others."""
    lengths, inverse = [0.0] * dimension, [0.0] * dimension
    for axis, low, high in edges:
        lengths[axis], inverse[axis] = high - low, 1.0 / (high - low)
    return {"period": lengths, "inv_period": inverse}


def faces_of(boundary, *conditions):
    """Numbers of the faces with one of these conditions: "mirrors", "rigid", "layers"."""
    return [WALLS.index(wall) for name in conditions for wall in getattr(boundary, name, ())]


def stiff_faces(boundary):
    """Numbers of the faces at which dust ends as at a rigid plane."""
    return faces_of(boundary, "rigid", "layers")


def cut_by_mirrors(body, particles, mirrors):
    """Axes of the mirrors that go through the centre of a rigid body: of it a half is there."""
    planes, near = particles.room.ravel(), 1e-3 * particles.spacing
    return [k // 2 for k in mirrors if abs(body.centre[k // 2] - planes[k]) < near]


def put_particles(sim, particles, moving, mirrors):
    """Put the particles and rigid bodies of a sample into the fields of a Simulation.

    mirrors: numbers of the faces that are.
    """
    axes, n = sim.axes, len(particles)
    role = particles.role.astype(np.int32)
    rank = np.cumsum([body.rigid for body in particles.bodies]) - 1
    group = particles.face.astype(np.int32)
    rigid = role == RIGID
    group[rigid] = FACES + rank[particles.body[rigid]]
    group[role == DUST] = -1
    elastic = role == ELASTIC
    moves = elastic | (role == DUST)
    rows = np.zeros((FACES + len(moving), COLUMN.count))
    rows[:FACES, COLUMN.turn] = 1.0
    planes = particles.room.ravel()
    for face in np.flatnonzero(np.isfinite(planes)):
        rows[face, COLUMN.centre + face // 2] = planes[face]
        rows[face, COLUMN.layer] = np.any(particles.face == face)
    rows[:, COLUMN["freedom"]] = 1.0
    for k, body in enumerate(moving):
        rows[FACES + k] = body_row(body, cut_by_mirrors(body, particles, mirrors))
    sim.tables["rigid"].from_numpy(rows)
    centre = rows[:, COLUMN["centre"]][group]
    S = particles.deviator
    full = S[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]] if sim.dimension == 3 else S[:, [0, 4, 4, 2]]
    volume = particles.mass / particles.density
    dust = sim.material
    if sim.layout.materials:
        dust = sim.materials.taken(particles.material)
    values = {
        "x": particles.position[:, axes],
        "v": particles.velocity[:, axes],
        "mass": particles.mass,
        "density": particles.density,
        "reference": particles.reference,
        "modulus": np.where(elastic, particles.modulus, bulk_modulus(particles.reference, dust)),
        "shear_ratio": np.where(elastic, particles.shear_ratio, dust.mu_over_K),
        "volume": np.where(moves, volume, 0.0),
        "deviator": np.where(rigid[:, None], 0.0, full),
        "arm": np.where(rigid[:, None], (particles.position - centre)[:, axes], 0.0),
        "group": group,
        "role": role,
        "number": np.arange(n, dtype=np.int32),
    }
    if "side" in sim.tables:
        values["side"] = np.where(elastic, 2 + particles.body, np.where(rigid, 1, 0))
    if sim.layout.separate:
        values["gap"] = np.full(n, CLOSED)
    for name, value in values.items():
        sim.put(name, value)
    if not moves.any():
        raise DustError(
            "sample: there is nothing that gives way; dust or what is elastic is needed"
        )


def put_options(sim, particles, scene):
    """Write the variables of options that are compiled in: materials, flaws."""
    if sim.layout.materials:
        sim.put("material", particles.material.astype(np.int32))
    if sim.layout.damage:
        sim.put("flaws", flaws_of(particles, scene.all_materials))


def begin(sim, scene):
    """Set the output step and the first time step from the initial speeds of signals."""
    fastest = float(sim.lists["most"].to_numpy().max())
    sim.output_step = time_step.output_step(scene, fastest)
    step = scene.numerics.cfl * scene.numerics.smoothing_length / fastest
    clock = np.zeros(8)
    clock[LEFT], clock[WANT] = sim.output_step, step
    clock[DT] = sim.output_step / np.ceil(sim.output_step / step * (1.0 - 1e-12))
    sim.tables["clock"].from_numpy(clock)


def domain_of(scene, sample, dt):
    """The Domain of a scene at the start; in two dimensions it is a metre deep."""
    boundary, room = scene.boundary, np.array(sample.room)
    if sample.dimension == 2:
        room[1] = -0.5 * DEPTH, 0.5 * DEPTH
    box = cell = None
    if boundary.walls:
        present = np.array([wall in boundary.walls for wall in WALLS], np.int32)
        faces = np.where(np.isnan(room), _extent(sample), room)
        offset = (faces * np.array([1.0, -1.0])).ravel()
        box = Box(NORMALS, offset, np.zeros(6), present.astype(float), present)
    axes = tuple(AXES.index(axis) for axis in boundary.periodic_axes)
    if axes:
        periodic = np.isin(np.arange(3), axes)
        edges = np.where(periodic, room[:, 1] - room[:, 0], 0.0)
        centre = np.where(periodic, room.mean(axis=1), 0.0)
        cell = Cell(edges, np.zeros(3), np.zeros(3), centre, axes)
    density = np.array([material.solid_density for material in scene.all_materials])
    solid = np.sum(sample.mass / density[sample.material])
    return Domain(dt, solid, sample.spacing, box, cell)


def _extent(sample):
    """Lowest and highest place of the particles along each axis [m], (3, 2)."""
    return np.stack([sample.position.min(axis=0), sample.position.max(axis=0)], axis=1)
