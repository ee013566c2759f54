"""Build a simulation from a scene and a sample, and choose what is compiled."""

from dataclasses import replace

import numpy as np

from dusttaichi import samples, units
from dusttaichi.compute.backend import loops_of, threads_of
from dusttaichi.compute.compiled import STRUCTURES
from dusttaichi.compute.memory import COARSE, capacity_for
from dusttaichi.domain.domain import Domain, lengths
from dusttaichi.errors import DustError
from dusttaichi.grains.compiled_grains import compiled_for, interfaces
from dusttaichi.grains.contact_table import ContactTable
from dusttaichi.grains.grain_engine import DIFFERING, PREFIX, SAMPLE, GrainEngine
from dusttaichi.grains.grain_ledger import ContactNumbers
from dusttaichi.grains.grain_properties import equal_properties, scale_materials
from dusttaichi.grains.kernels import store
from dusttaichi.grains.kernels.contact_numbers import internal_numbers
from dusttaichi.grains.kernels.declare import declare
from dusttaichi.grains.kernels.polydisperse import list_stored_numbers
from dusttaichi.grains.order import order_by_members
from dusttaichi.grains.outside_forces import choose_model, make_forces
from dusttaichi.grains.placement import is_tilted, place_environment
from dusttaichi.grains.pushes import make_push
from dusttaichi.grains.rigid_sphere import place_sphere
from dusttaichi.grains.setup import Prepared
from dusttaichi.grains.surface_placement import choose_surfaces, place_surfaces
from dusttaichi.grains.time_step import chosen_step
from dusttaichi.physics.contact import constants
from dusttaichi.physics.contact.effect_registry import chosen_model
from dusttaichi.physics.geometry import AXES
from dusttaichi.scene.push import list_stage_pushes

RESOLVED = 0.005  # largest uncertainty of positions over the overlap at rest


def build(scene, sample, *, loops=None, ledger=True, step=None):
    """GrainEngine of a scene with a Sample, with its contacts and loads.

    loops: backend.Loops other than those of the backend, to compare them. ledger: False leaves the
    losses out, to measure their run time. step: a TimeStep instead of that of the scene, stable or
    not. The engine built before must not be used any more: its fields and kernels may be reused.
    Raises DustError for a sample that does not fit, or a step that cannot be stable.
    """
    preparation = prepare(scene, sample, loops=loops, ledger=ledger, step=step)
    layout, grains, walls = (
        preparation.layout,
        len(preparation.order),
        preparation.domain.box is not None,
    )
    compiled = choose_kernels(
        preparation.scene, layout, (preparation.loops.execution, grains, preparation.threads)
    )
    rows = {var.name: var.shape[0] for var in declare(grains, layout, walls)}
    tables = STRUCTURES.tables(compiled, rows)
    tables[0]["counts"].from_numpy(np.array(store.sizes(grains, layout, walls)))
    numbers, rows = choose_numbers(preparation.contact_table, layout.model)
    if rows is not None:
        tables[1]["interfaces"].from_numpy(rows)
    return GrainEngine(scene, preparation, compiled, tables, numbers)


def make(scene, sample, step=None):
    """GrainEngine of a scene and a Sample, at step 0; step: as for `build`.

    Raises DustError where walls or faces cannot move as the scene says.
    """
    engine = build(scene, sample, step=step)
    engine.domain.check_start()
    return engine


def reopen(scene, state):
    """GrainEngine in a State of grains of that scene."""
    differing = {name: state.arrays.get(PREFIX + name) for name in DIFFERING}
    arrays = (state.arrays[PREFIX + name] for name in SAMPLE)
    info = state.numbers["sample_info"]
    engine = make(scene, samples.Sample(*arrays, info=info, **differing))
    engine.restore(state)
    return engine


def prepare(scene, sample, *, loops=None, ledger=True, step=None):
    """Prepared of a scene with a sample; nothing is compiled. Arguments, errors as of `build`."""
    sample, scene = samples.apply_pushes(scene, sample), scale_materials(scene)
    pushed_sample = sample
    table = ContactTable.for_sample(scene, sample)
    grain_properties = table.properties
    check_precision(scene, sample, ContactTable(scene).farthest_pair.rest_overlap)
    properties = equal_properties(scene.material) if grain_properties is None else grain_properties
    radii = properties.radius / units.LENGTH
    surfaces = place_surfaces(table, sample.positions / units.LENGTH, radii)
    step = step or chosen_step(table, sample)
    dt = step.dt / units.TIME
    surfaces = surfaces and surfaces.with_step(dt)
    smallest, largest = float(np.min(radii)), float(np.max(radii))
    order = order_by_members(sample.positions / units.LENGTH, radii, sample.info.get("members"))
    push = make_push(
        scene.push, sample.info, order, dt, {push.kind for push in list_stage_pushes(scene)}
    )
    box, cell = place_environment(table, sample)
    sample = describe_images(scene, sample, cell)
    volume = len(order) * 4.0 / 3.0 * np.pi * radii**3
    if grain_properties is not None:
        volume = float(np.sum(4.0 / 3.0 * np.pi * radii**3))
    t_c = constants.characteristic_time(scene.material.unscaled) / units.TIME
    loops = loops or loops_of(scene.numerics)
    model = chosen_model(scene.interaction, scene.numerics.newton_steps)
    layout = replace(
        choose_layout(
            scene,
            model,
            loops,
            push,
            polydisperse=grain_properties is not None,
            members="members" in sample.info,
        ),
        ledger=ledger,
        tilted=is_tilted(scene, sample),
        few_wall_contacts=has_few_wall_contacts(
            box, cell, len(order), smallest, surfaces is not None
        ),
    )
    skin = scene.numerics.skin
    return Prepared(
        scene,
        sample,
        pushed_sample,
        properties,
        order,
        step,
        domain=Domain(dt, volume, largest, box, cell, t_c, units=units.GRAINS, surfaces=surfaces),
        sphere=place_sphere(scene, sample, grain_properties, box),
        forces=make_forces(scene, layout.forces, sample, properties),
        push=push,
        contact_table=table,
        skin=None if skin == "auto" else skin * smallest,
        threads=threads_of(scene, len(order)),
        loops=loops,
        layout=layout,
    )


def describe_images(scene, sample, cell):
    """The Sample with the measures that it has in a domain.Cell, None without one.

    scene: `scale_materials`. A sample that has been described in this cell is returned as it is.
    """
    if cell is None:
        return sample
    periodic = np.isin(np.arange(3), cell.axes)
    period = np.where(periodic, cell.edges(0.0) * units.LENGTH, np.inf)
    scene_cell = samples.Cell(period, cell.offset(0.0) * units.LENGTH)
    materials = samples.Materials(scene)
    sample_cell = samples.find_cell(sample.info, materials)
    same = np.allclose(sample_cell.period, period) and np.isclose(sample_cell.tilt, scene_cell.tilt)
    if same and "network" in sample.info:
        return sample
    return samples.describe_in_cell(sample, materials.radii_of(sample), scene_cell)


def choose_numbers(table, model):
    """Internal numbers of a contact of two grains, with a wall, with the sphere (None without).

    And with each surface. Each is the contact of a ContactTable with the longest reach; also the
    rows of interfaces (None of equal grains).
    """
    pair, wall = (internal_numbers(c, model) for c in (table.farthest_pair, table.farthest_wall))
    sphere = table.farthest_sphere
    on_sphere = None if sphere is None else internal_numbers(sphere, model)
    curved = tuple(internal_numbers(c, model) for c in table.farthest_on_surfaces)
    rows = None if table.properties is None else interfaces(table.scene, model)
    return ContactNumbers(pair, wall, on_sphere, curved), rows


def choose_layout(scene, model, loops, push, *, polydisperse, members=False):
    """The Layout of the numbers that a scene needs; members: see grains.members."""
    curved = choose_surfaces(scene)
    return store.Layout(
        width=loops.width,
        tile=loops.tile,
        model=model,
        periodic=tuple(AXES.index(axis) for axis in scene.boundary.periodic_axes),
        stress=scene.output.stress,
        forced=push.forced,
        carried=push.carried,
        stored=list_stored_numbers(model, scene.softened, bool(curved)) if polydisperse else (),
        precision=scene.numerics.precision,
        sphere=scene.sphere is not None,
        curved=curved,
        forces=choose_model(scene),
        orientation=scene.output.requests("orientation"),
        contact_loss=scene.output.requests("loss"),
        grain_loss=scene.output.requests("grain_loss") or members,
        members=members,
    )


def has_few_wall_contacts(box, cell, grains, smallest, curved=False):
    """True if the smaller capacity for wall contacts is enough.

    curved: there are surfaces. Walls (a Box or None, a Cell or None) then touch few of many grains.
    smallest: radius of a grain [um]. A wall is full where grains cover it in a hexagonal layer. A
    fifth more may be near it: grains of a buckled layer, overlapping ones, and those that a wall
    that moves outwards adds.
    """
    if box is None or curved or grains <= COARSE:
        return False
    edges = lengths(box, cell, 0.0)
    # NaN along an open axis: the extent of the grains is not limited
    areas = [np.prod(np.delete(edges, n // 2)) for n in np.flatnonzero(box.present)]
    full = sum(areas) / (2.0 * np.sqrt(3.0) * smallest**2)
    return bool(1.2 * full <= store.wall_contacts(grains, few=True))


def choose_kernels(scene, layout, running):
    """The Compiled of a scene; running: kind of the loops, number of grains and threads."""
    execution, grains, threads = running
    walls, room = scene.has_walls, capacity_for(grains)
    materials = len(scene.all_materials)
    started = ("grains", scene.numerics.backend, scene.numerics.debug, threads)
    key = (*started, room, layout, walls, materials, execution)
    return STRUCTURES.get(key, scene, threads, lambda key: compiled_for(key, scene, layout, room))


def check_precision(scene, sample, delta0):
    """Raise DustError where single precision does not resolve overlaps; delta0 [m]: at rest."""
    resolved = 2.0**-24 * float(np.abs(sample.positions).max())
    if scene.numerics.precision == "f32" and resolved > RESOLVED * delta0:
        raise DustError(
            f"numerics.precision = f32: single precision knows the positions of this sample to "
            f"{resolved * 1e12:.2g} pm, and grains at rest overlap by {delta0 * 1e12:.3g} pm, of "
            f"which {RESOLVED:.1%} must be resolved; try mixed or f64, or a sample below "
            f"{RESOLVED * delta0 * 2.0**24 * 1e6:.2g} µm about the origin"
        )
