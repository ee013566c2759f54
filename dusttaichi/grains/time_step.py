"""The choice of the time step: what is stable, and what resolves how fast grains meet at first.

And the stages with too few of these steps.
"""

from dataclasses import dataclass, replace
from math import inf, pi

import numpy as np

from dusttaichi.domain.walls import wall_strengths
from dusttaichi.errors import DustError
from dusttaichi.grains.impacts import Impact, check, hardest_impact
from dusttaichi.physics import encounter, stability
from dusttaichi.physics.contact import constants
from dusttaichi.scene import quantities
from dusttaichi.scene.drive import STRAIN_RATE
from dusttaichi.scene.forces import find_shortest_timescale, list_forces
from dusttaichi.scene.push import list_stage_pushes
from dusttaichi.scene.surfaces import find_fastest, list_motions

BALANCED = 0.2  # step_fraction for which physics.encounter was calibrated
SAFE = 1.4  # largest fraction of its limit of a step that strong damping limits
LOOSE = 1.0  # contacts per grain below which the initial binding energy is negligible
FLOOR = (None, None, None, None, 1.0, None)  # strengths of a wall below alone
FEW = 13  # grains below which one collision dominates
SETTLING = 15_000
"""Steps within which a load is reached; with or without softening it took 4000 to 13,000
(docs/studies/trade.md). The controller changes the speed after a number of steps, not a time."""


@dataclass(frozen=True)
class TimeStep:
    """The step [s], and the numbers that it follows from.

    The stiffest period, the largest stable step, the longest step that resolves impacts and spins,
    and the hardest Impact of the start.
    """

    dt: float
    period: float
    limit: float
    resolved: float = inf
    impact: Impact | None = None


def chosen_step(table, sample) -> TimeStep:
    """The TimeStep that the scene of a ContactTable takes with a sample (pushed).

    Raises DustError for a step that cannot be stable, or speeds that the contacts are not for.
    """
    equal = table.properties is None
    radii = table.scene.material.radius if equal else table.properties.radius
    motion = fastest(table.scene, sample, radii)
    step = time_step(table, len(sample), motion)
    impact = hardest_impact(table.extreme_pairs, motion.thrown)
    check(impact)
    return replace(step, impact=impact)


def time_step(table, grains, motion=None):
    """The step of the scene of a ContactTable with that number of grains.

    motion: Motion of the sample; without it nothing moves fast. `auto` is step_fraction of the
    stiffest period, or less where fast grains need it.
    Raises DustError when the requested step cannot be stable.
    """
    numerics = table.scene.numerics
    resolved = inf if motion is None else step_of_motion(table, motion)
    period, rate = stiffest_of(table, grains)
    limit = stability.largest_stable_step(period, rate)
    outside = shortest_timescale(table)
    period, limit = min(period, outside), min(limit, outside / pi)
    if numerics.time_step == "auto":
        if not np.isfinite(period):
            raise DustError(
                "numerics.time_step = auto: one free grain has no period to take the step from; "
                'give a step, for example "0.3 ns"'
            )
        fraction = numerics.step_fraction
        resolved *= min(1.0, fraction / BALANCED)
        dt = min(fraction * period, fraction * pi * limit * SAFE, resolved)
        return TimeStep(dt, period, limit, resolved)
    dt = numerics.time_step
    if rate > 0.0 and dt >= limit:
        limit = min(
            stability.damped_limit(mass, pair, wall, grains, strengths)
            for mass, pair, wall, strengths in list_clusters(table)
        )
        limit = min(limit, outside / pi)
    if dt >= limit:
        raise DustError(
            f'numerics.time_step = "{dt * 1e9:.4g} ns": not stable. The stiffest period of this '
            f"scene is {period * 1e9:.4g} ns and the leapfrog needs less than "
            f'{limit * 1e9:.4g} ns with this damping; try "auto", or {0.6 * limit * 1e9:.3g} ns'
        )
    return TimeStep(dt, period, limit, resolved)


def stiffest_of(table, grains):
    """(shortest period [s], highest damping rate [1/s]), see physics.stability.

    For polydisperse grains each cluster has grains of the smallest radius of a
    material, all with the springs of such a grain's contact with the largest grain of each
    material. That is on the safe side (by a quarter for small grains among very large ones), as
    springs grow with the size of the partner and frequencies fall with the mass.
    """
    periods = [
        stability.stiffest(mass, pair, wall, grains, strengths)
        for mass, pair, wall, strengths in list_clusters(table)
    ]
    return min(period for period, _ in periods), max(rate for _, rate in periods)


def list_clusters(table):
    """(mass [kg], ContactConstants of a pair, of a wall, strengths of the walls) of clusters.

    In each all grains are the smallest of a material, with the springs of its contact with the
    largest of a material; a rigid sphere counts as a wall that grains touch.
    """
    scene, clusters = table.scene, []
    strengths = wall_strengths(scene.boundary)
    for a, small, _ in table.size_ranges:
        mass = constants.sphere_mass(small, scene.all_materials[a].density)
        for b, _, large in table.size_ranges:
            pair = table.pair((a, small), (b, large))
            clusters.append((mass, pair, table.wall((a, small)), strengths))
            if scene.sphere is not None:
                clusters.append((mass, pair, table.sphere((a, small)), FLOOR))
            for n in table.surface_numbers:
                clusters.append((mass, pair, table.surface((a, small), n), FLOOR))
    return clusters


def shortest_timescale(table):
    """Shortest time [s] in which a force from outside changes a motion; infinite without one.

    table: ContactTable, of whose extreme grains.
    """
    scene, numbers, radii = table.scene, *zip(*table.extreme_grains, strict=True)
    radius, densities = np.array(radii), [scene.all_materials[n].density for n in numbers]
    mass = np.array(list(map(constants.sphere_mass, radii, densities)))
    charge = np.zeros(len(mass)) if scene.charge is None else scene.charge.bound(mass, radius)
    return find_shortest_timescale(list_forces(scene), radius=radius, mass=mass, charge=charge)


def step_of_motion(table, motion):
    """Longest step [s] that resolves impacts and spins; see physics.encounter."""
    alone = motion.alone
    steps = [encounter.step(c, motion.grains, alone) for c in table.extreme_pairs]
    if table.scene.has_walls:
        steps += [encounter.step(c, motion.walls, alone) for c in table.extreme_walls]
    steps += [encounter.step(c, motion.sphere, alone) for c in table.extreme_spheres]
    return min(*steps, encounter.TURN / motion.spin if motion.spin > 0.0 else inf)


@dataclass(frozen=True)
class Motion:
    """Largest relative speeds [m/s] and spin [rad/s].

    Speeds of two grains, of a grain and a wall, and of a grain and the sphere. alone: one collision
    dominates: few grains, or hardly any that touch. thrown: relative speed of two grains without
    the parts of spins and of the faces of a cell.
    """

    grains: float
    walls: float
    spin: float
    alone: bool
    sphere: float = 0.0
    thrown: float = 0.0


def fastest(scene, sample, radii):
    """Motion of a scene with a sample (already pushed). radii [m]: one number, or (N,).

    Bounds, not estimates: velocities by their range along each axis; a wall throws grains at twice
    its speed, a face moves their images at the speed of the cell's edge; a spinning surface throws
    grains at its full speed at most. Speeds by forces from outside are not known in advance.
    """
    v = sample.velocities
    apart = float(np.linalg.norm(np.ptp(v, axis=0))) if len(v) else 0.0
    surface = float(np.max(np.linalg.norm(sample.spins, axis=1) * radii, initial=0.0))
    spin = float(np.max(np.linalg.norm(sample.spins, axis=1), initial=0.0))
    wall = max(_wall_speed(plan.drive) for plan in scene.stage_plans)
    wall = max(wall, find_fastest(scene))
    face = max(_face_speed(scene, plan.drive, sample, radii) for plan in scene.stage_plans)
    later = [p.velocity or p.speed or (0.0,) * 3 for p in list_stage_pushes(scene)]
    later = max((float(np.linalg.norm(speed)) for speed in later), default=0.0)
    initial_speed = float(np.max(np.linalg.norm(v, axis=1), initial=0.0)) + later
    loose = sample.info.get("coordination", 2.0 * LOOSE) < LOOSE
    sphere = _sphere_speed(scene)
    # a sphere throws grains at twice its speed at most, as a wall does
    thrown = apart + later + 2.0 * sphere + (2.0 * wall if scene.has_walls else 0.0)
    return Motion(
        grains=thrown + surface + face,
        walls=initial_speed + surface + wall,
        spin=spin,
        alone=len(sample) < FEW or loose,
        sphere=initial_speed + surface + wall + sphere,
        thrown=thrown,
    )


def _sphere_speed(scene):
    """Largest speed of the surface of the sphere [m/s]; 0 without one."""
    if scene.sphere is None:
        return 0.0
    block, norm = scene.sphere, np.linalg.norm
    driven = [block.speed or (0.0,) * 3]
    driven += [plan.drive.sphere_speed or (0.0,) * 3 for plan in scene.stage_plans]
    initial_speed = float(norm(block.velocity) + norm(block.spin) * block.radius)
    return max(initial_speed, *(float(norm(speed)) for speed in driven))


def _wall_speed(drive):
    """Largest speed of a wall under a drive [m/s]."""
    speed = abs((drive.wall_speed if drive.pressure is None else drive.largest_wall_speed) or 0.0)
    return float(np.hypot(speed, drive.shear_speed or 0.0))


def _face_speed(scene, drive, sample, radii):
    """Largest speed of an image against the cell [m/s]."""
    axes = ["xyz".index(axis) for axis in scene.boundary.periodic_axes]
    if not axes or not (drive.moving_faces or drive.shears or drive.controls_load):
        return 0.0
    if drive.face_speed is not None:
        return float(np.linalg.norm(2.0 * np.array(drive.face_speed)[axes]))
    size = getattr(scene.boundary, "size", "fit")
    edges = np.ptp(sample.positions, axis=0) + 2.0 * np.max(radii)
    if not isinstance(size, str):
        sizes = zip(size, edges, strict=True)
        edges = np.array([length if isinstance(edge, str) else edge for edge, length in sizes])
    rate = np.zeros(3)
    if drive.strain_rate is not None:
        rate = np.array(drive.strain_rate)
    elif drive.compression_rate is not None:
        t_c = constants.characteristic_time(scene.material.unscaled)
        rate[:] = 2.0 * drive.compression_rate / t_c
    elif drive.controls_load and len(axes) == 3:
        rate[:] = STRAIN_RATE
    faces = float(np.linalg.norm((rate * edges)[axes]))
    return faces + abs(drive.shear_rate or 0.0) * float(edges[2])


def short_loads(scene, dt):
    """Sentences for the user about the stages that end before; dt: time step [s]."""
    pressed = [any(motion.load is not None for motion in row) for row in list_motions(scene)]
    return [
        f"stage {plan.name} controls a load for {steps:,} steps: reaching a load takes up to "
        f"{SETTLING:,}; end it with stop.creep, or give stop.time at least "
        f"{quantities.format(SETTLING * dt, 'time', digits=2)}"
        for plan, presses in zip(scene.stage_plans, pressed, strict=True)
        if (presses or plan.drive.controls_load) and (steps := _steps_of(plan.stop, dt)) < SETTLING
    ]


def _steps_of(stop, dt):
    """Steps of a stage that ends after a time or a number of steps; infinite for others."""
    keys = {key for key in type(stop).model_fields if getattr(stop, key) not in (None, {})}
    if not keys or not keys <= {"time", "steps"}:
        return float("inf")
    step_counts = [stop.steps, None if stop.time is None else round(stop.time / dt)]
    return min(n for n in step_counts if n is not None)
