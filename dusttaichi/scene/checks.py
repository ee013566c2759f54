"""Conditions that involve more than one block of a scene."""

import math

from dusttaichi.names import AXES
from dusttaichi.physics.contact import constants
from dusttaichi.scene import push
from dusttaichi.scene.boundary import (
    FACE_LAWS,
    BoxBoundary,
    PeriodicBoundary,
    PlatesBoundary,
    bounded_axes,
    filling_direction,
    own_drive,
    strains,
)
from dusttaichi.scene.output import applies
from dusttaichi.scene.sample import (
    DEFAULT,
    CollisionSample,
    CylinderSize,
    ExplicitSample,
    PairSample,
    RbdSample,
)

Found = list[tuple[str, str]]
LARGEST_CONTACT = 0.25  # of the radius: grains at rest then overlap by a twentieth of it
LEAST_POISSON = 0.01
DENSEST = 0.74  # filling factor of the densest packing of equal spheres


def check(scene) -> Found:
    """Every problem of the blocks that all methods share, as (dotted path, text)."""
    found = [*_ends(scene), *_own_drive(scene)]
    if not found:
        for path, plan in zip(_paths(scene), scene.stage_plans, strict=True):
            found += [*_drive(scene, path, plan), *_stop(scene, path, plan)]
            found += _intervals(scene, path, plan)
    return [*found, *_stress(scene)]


def check_grains(scene) -> Found:
    """Every problem of the blocks that belong to the method `grains`, as (dotted path, text)."""
    found = [*push.check(scene), *_asperities(scene)]
    found += [*_contacts(scene), *_damping(scene)]
    found += [*_mass_scaling(scene), *_materials(scene)]
    return [*found, *_sizes(scene), *_room(scene)]


def _paths(scene):
    """Prefix of the path of each stage's blocks."""
    return [f"stages.{n}." for n in range(len(scene.stages))] or [""]


def _ends(scene) -> Found:
    if scene.stop is None and not scene.stages:
        return [("stop", "it is missing (when the run ends); give stop, or stages with one each")]
    if scene.stop is not None and scene.stages:
        return [("stop", "each of the stages has its own; remove this one")]
    names = [stage.name for stage in scene.stages]
    return [
        (f"stages.{n}.name", f'the name "{name}" is used already; every stage needs its own')
        for n, name in enumerate(names)
        if name in names[:n]
    ]


def _own_drive(scene) -> Found:
    """With stages, the drive belongs to them."""
    if not scene.stages or not own_drive(scene.boundary).moves:
        return []
    drive = own_drive(scene.boundary)
    keys = ("wall_speed", *FACE_LAWS)
    return [
        (f"boundary.{key}", "with stages it belongs to the drive of each stage")
        for key in keys
        if getattr(drive, key)
    ]


def _drive(scene, path, plan) -> Found:
    """Every part of the drive must have something to move."""
    boundary, found = scene.boundary, []
    where = f"{path}drive" if path else "boundary"
    if plan.drive.wall_speed and "wall_speed" not in boundary.drives:
        left_out = isinstance(boundary, BoxBoundary)
        text = (
            'the top wall is left out, so it cannot move; remove wall_speed, or "top" from '
            "boundary.omit"
            if left_out
            else "there is no top wall that could move; allowed with kind: box, plates, or "
            "periodic with the top wall among boundary.walls"
        )
        found.append((f"{where}.wall_speed", text))
    for law in FACE_LAWS:
        values = getattr(plan.drive, law)
        if values is None:
            continue
        if not isinstance(boundary, PeriodicBoundary):
            found.append((f"{where}.{law}", "it moves the faces of kind: periodic only"))
        elif isinstance(values, tuple):
            # one value for all axes is meant for those that repeat
            idle = [
                axis
                for axis, v in zip(AXES, values, strict=True)
                if v and axis not in boundary.axes
            ]
            if idle and len(set(values)) > 1:
                found.append((f"{where}.{law}", f"the axis {idle[0]} does not repeat; give it 0"))
    return found


def _stop(scene, path, plan) -> Found:
    stop, found = plan.stop, []
    where = f"{path}stop"
    if stop.filling_factor is not None:
        found += _stop_filling_factor(scene.boundary, plan.drive, f"{where}.filling_factor")
    ends_anyway = stop.time is not None or stop.steps is not None or stop.strain is not None
    if stop.pressure is not None:
        found += _stop_pressure(scene, plan.drive, ends_anyway, f"{where}.pressure")
    moving = strains(scene.boundary, plan.drive)
    if stop.strain is not None and not moving:
        found.append(
            (f"{where}.strain", "nothing strains: no wall or face moves; stop by time or steps")
        )
    if stop.past_maximum is not None:
        pulls = isinstance(scene.boundary, PlatesBoundary) or scene.output.stress
        if not moving:
            found.append((f"{where}.past_maximum", "nothing is pulled: no wall or face moves"))
        elif not pulls:
            found.append(
                (
                    f"{where}.past_maximum",
                    "no tension is measured; use kind: plates or periodic, or output.stress: true",
                )
            )
        elif not ends_anyway and stop.filling_factor is None:
            found.append(
                (
                    f"{where}.past_maximum",
                    "the tension may have no maximum; add a strain, "
                    "a time or steps as the latest end",
                )
            )
    return found


def _stop_filling_factor(boundary, drive, where) -> Found:
    if isinstance(boundary, PlatesBoundary):
        if drive.wall_speed:
            return []
    elif bounded_axes(boundary) != AXES:
        return [
            (
                where,
                "it is never reached without all six walls; use kind: box without omit, "
                "kind: plates, or kind: periodic, or stop by time or steps",
            )
        ]
    elif filling_direction(boundary, drive):
        return []
    if isinstance(boundary, PeriodicBoundary):
        text = (
            "it is never reached: no face moves, or some move in and some out; set "
            "compression_rate, strain_rate or face_speed, or stop by strain, time or steps"
        )
        return [(where, text)]
    return [
        (
            where,
            "it is never reached while the top wall rests; "
            'set boundary.wall_speed, for example "1 cm/s"',
        )
    ]


def _stop_pressure(scene, drive, ends_anyway, where) -> Found:
    boundary = scene.boundary
    if scene.output.stress and bounded_axes(boundary) == AXES and boundary.periodic_axes:
        if drive.moves or ends_anyway:
            return []
        return [(where, "it may never be reached while no face moves; add a time or steps")]
    if "top" not in boundary.walls:
        return [
            (
                where,
                "it is the pressure on the top wall, and there is none; "
                "use kind: box or plates, or stop by time or steps",
            )
        ]
    if not (drive.wall_speed or 0.0) > 0.0 and not ends_anyway:
        text = (
            "it may never be reached while the top wall rests; "
            'set boundary.wall_speed, for example "1 cm/s", or add a time or steps'
        )
        return [(where, text)]
    if "bottom" not in boundary.walls and not ends_anyway:
        return [(where, "it may never be reached without a bottom wall; add a time or steps")]
    return []


def _intervals(scene, path, plan) -> Found:
    found = []
    for name in ("series", "profiles", "snapshots"):
        interval = getattr(plan, name)
        if interval is None:
            continue
        where = f"{path}output.{name}"
        ready = applies(interval, scene.boundary, plan.drive)
        if interval.filling_factor is not None and not ready:
            text = (
                "the filling factor changes steadily only in a room that is bounded along all axes "
                "and driven one way; use strain, steps or time"
            )
            found.append((f"{where}.filling_factor", text))
        if interval.strain is not None and not ready:
            found.append((f"{where}.strain", "nothing strains; use steps or time"))
        step = scene.numerics.time_step
        if interval.time is not None and step != "auto" and interval.time < step:
            found.append((f"{where}.time", "it is shorter than numerics.time_step"))
    return found


def _asperities(scene) -> Found:
    asperities = scene.interaction.asperities
    if asperities is None or asperities.volume is not None:
        return []
    if scene.material.asperity_volume is not None:
        return []
    return [
        (
            "interaction.asperities.volume",
            "it is missing, and the material has no "
            "asperity_volume; give one, for example {volume: 0.01 nm}",
        )
    ]


def _kinds(scene):
    """(path, Material) of all materials."""
    return [("material", scene.material)] + [
        (f"materials.{name}", material) for name, material in scene.materials.items()
    ]


def _contacts(scene) -> Found:
    """JKR is a law for contacts that are small against the grains."""
    found = []
    for path, m in _kinds(scene):
        R, E_star = constants.reduced_radius(m.radius, m.radius), constants.reduced_modulus(m)
        share = constants.equilibrium_contact_radius(m.surface_energy, R, E_star) / m.radius
        if share > LARGEST_CONTACT:
            text = (
                f"the contact of two grains at rest would have {share:.3g} of their radius, and "
                f"adhesive elastic contacts (JKR) mean nothing beyond {LARGEST_CONTACT}; allowed: "
                "grains that are stiffer, larger or stick less"
            )
            found.append((path, text))
    return found


def _damping(scene) -> Found:
    """Viscoelastic damping divides by nu^2."""
    if scene.interaction.damping.model != "viscoelastic":
        return []
    text = (
        f"viscoelastic damping grows as 1/nu^2; allowed with it: {LEAST_POISSON} and more, or "
        "interaction.damping: viscous, scaled or none"
    )
    return [
        (f"{path}.poisson_ratio", text)
        for path, material in _kinds(scene)
        if material.poisson_ratio < LEAST_POISSON
    ]


def _mass_scaling(scene) -> Found:
    """Heavier grains leave forces at rest as they are, and nothing else."""
    if scene.numerics.mass_scaling == 1.0:
        return []
    driven = (
        any(plan.drive.moves for plan in scene.stage_plans) if scene.stop or scene.stages else True
    )
    why = None
    if scene.push:
        why = "a push is answered by the inertia of the grains"
    elif isinstance(scene.sample, (PairSample, CollisionSample)):
        why = "a collision is a matter of kinetic energy"
    elif scene.interaction.asperities is not None:
        why = "asperities take kinetic energy"
    elif not driven:
        why = "no wall or face moves"
    text = "it is for quasi-static runs, in which a wall or a face moves slowly; 1 is allowed here"
    return [("numerics.mass_scaling", f"{text}: {why}")] if why else []


def _stress(scene) -> Found:
    if scene.output.stress and bounded_axes(scene.boundary) != AXES:
        text = (
            "a stress needs a volume: a room that is bounded along all axes; "
            "use kind: box without omit or kind: periodic with all axes, or false"
        )
        return [("output.stress", text)]
    return []


def _materials(scene) -> Found:
    """Grains must be of a material that there is."""
    found, sample = [], scene.sample
    blocks = {"sample": sample}
    if isinstance(sample, CollisionSample):
        blocks = {"sample.target": sample.target, "sample.projectile": sample.projectile}
    names = [DEFAULT, *scene.materials]
    for path, block in blocks.items():
        if not isinstance(block, (ExplicitSample, PairSample)):
            continue
        for n, name in enumerate(block.materials or ()):
            if name not in names and not (isinstance(name, int) and 0 <= name < len(names)):
                found.append(
                    (
                        f"{path}.materials",
                        f"number {n} is {name!r}, which the scene does "
                        f"not have; allowed: {', '.join(names)}",
                    )
                )
                break
    return found


def _lengths(size) -> tuple[float, ...]:
    if isinstance(size, CylinderSize):
        return (size.diameter, size.diameter, size.height)
    return size


def _sizes(scene) -> Found:
    diameter = 2 * scene.material.radius
    sizes = {}
    if isinstance(scene.boundary, BoxBoundary) and scene.boundary.size != "fit":
        sizes["boundary.size"] = scene.boundary.size
    if isinstance(scene.boundary, PlatesBoundary) and scene.boundary.gap != "fit":
        sizes["boundary.gap"] = (scene.boundary.gap,)
    if isinstance(scene.sample, RbdSample) and scene.sample.size is not None:
        sizes["sample.size"] = _lengths(scene.sample.size)
    found = [
        (path, "every side must be at least as long as a grain is wide (2 x material.radius)")
        for path, size in sizes.items()
        if min(size) < diameter
    ]
    cell = scene.boundary
    if isinstance(cell, PeriodicBoundary) and not isinstance(cell.size, str):
        short = [
            axis
            for axis, edge in zip(AXES, cell.size, strict=True)
            if axis in cell.axes and edge < 2 * diameter
        ]
        if short:
            found.append(
                (
                    "boundary.size",
                    f"the edge along {short[0]} is shorter than four radii: "
                    "a grain would touch another twice, across both faces",
                )
            )
    return found


def _room(scene) -> Found:
    """The sample must fit into a box whose size is given."""
    box, sample = scene.boundary, scene.sample
    if not isinstance(box, BoxBoundary) or box.size == "fit":
        return []
    radius = scene.material.radius
    grains, volume = 0, None
    extent = (0.0, 0.0, 0.0)
    if isinstance(sample, RbdSample):
        grains = sample.grains or 0
        extent = _lengths(sample.size) if sample.size is not None else extent
    elif isinstance(sample, ExplicitSample) and sample.positions is not None:
        grains = len(sample.positions)
        columns = list(zip(*sample.positions, strict=True))
        extent = tuple(max(column) - min(column) + 2 * radius for column in columns)
        if sample.radii is not None or sample.materials is not None:
            # left to the sample, which knows the radius of each grain
            extent = (0.0, 0.0, 0.0)
            volume = 0.0
    # The extent is a sum of rounded numbers; a millionth of a millionth is far below any length.
    if any(need > have * (1 + 1e-12) for need, have in zip(extent, box.size, strict=True)):
        return [("boundary.size", 'the sample does not fit into it; make it larger or write "fit"')]
    volume = grains * 4 / 3 * math.pi * radius**3 if volume is None else volume
    filling = volume / math.prod(box.size)
    if filling > DENSEST:
        return [
            (
                "boundary.size",
                f"{grains} grains would fill {filling:.2f} of it, more than "
                f'{DENSEST}; make it larger or write "fit"',
            )
        ]
    return []
