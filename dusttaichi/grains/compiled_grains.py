"""Compiled fields and kernels of a layout of grains."""

from types import SimpleNamespace

from dusttaichi.compute.compiled import STRUCTURES, Compiled
from dusttaichi.compute.device_blocks import on_device
from dusttaichi.compute.engine import ti
from dusttaichi.compute.loops import advance_by
from dusttaichi.compute.memory import capacity_for
from dusttaichi.grains.contact_table import surface_of
from dusttaichi.grains.grain_ledger import ContactNumbers
from dusttaichi.grains.kernels import grain_cells
from dusttaichi.grains.kernels.cell_kinematics import make_wrap
from dusttaichi.grains.kernels.contact_numbers import internal_numbers
from dusttaichi.grains.kernels.contact_pass import ContactPass
from dusttaichi.grains.kernels.declare import declare, place
from dusttaichi.grains.kernels.device import ContactThreads, by_threads
from dusttaichi.grains.kernels.grain_losses import make_add_grain_losses
from dusttaichi.grains.kernels.load_sums import make_load_sums, place_load_sums
from dusttaichi.grains.kernels.measure import make_measure, place_measure
from dusttaichi.grains.kernels.members import make_measure_members, place_member_sums
from dusttaichi.grains.kernels.neighbour_lists import make_neighbour_lists
from dusttaichi.grains.kernels.polydisperse import interface_table, make_write_constants
from dusttaichi.grains.step import Phases, make_evaluate, steps_of


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


def choose_kernels(scene, layout, running):
    """The Compiled of a scene; running: kind of the loops, number of grains and threads."""
    execution, grains, threads = running
    walls, room = scene.has_walls, capacity_for(grains)
    materials = len(scene.all_materials)
    started = ("grains", scene.numerics.backend, scene.numerics.debug, threads)
    key = (*started, room, layout, walls, materials, execution)
    return STRUCTURES.get(key, scene, threads, lambda key: compiled_for(key, scene, layout, room))


def compiled_for(key, scene, layout, room):
    """The Compiled of a layout for `room` grains, and the kind of loops that is last in its key.

    Of its kernels it has those that the scene needs, by name. Taichi runs.
    """
    walls, execution = scene.has_walls, key[-1]
    fields = place(declare(room, layout, walls), by_columns=execution == "launches")
    scratch = grain_cells.place_search(room, layout, walls)
    sums = place_measure(room, layout, walls)
    sums |= place_member_sums(room, layout) if layout.members else {}
    sums |= place_load_sums(room, layout, walls) if on_device() else {}
    write = None
    if layout.polydisperse:
        shape = interfaces(scene, layout.model).shape
        table = scratch["interfaces"] = ti.field(ti.f64, shape=shape)
        write = make_write_constants(fields, table, scene, layout)
    phases = Phases(fields, layout, walls, ContactThreads if on_device() else ContactPass)
    step_phases = steps_of(phases)
    kernels = SimpleNamespace(
        advance=advance_by(execution, step_phases, lambda: by_threads(phases, layout, step_phases)),
        evaluate=make_evaluate(phases),
        bounds=grain_cells.make_bounds(fields, scratch),
        list_neighbours=make_neighbour_lists(
            fields, scratch, layout, walls=walls, write_constants=write
        ),
        **make_measure(fields, sums, layout, phases),
    )
    if layout.members:
        vars(kernels).update(make_measure_members(fields, sums, layout, phases.pairs))
    if layout.periodic:
        kernels.wrap = make_wrap(fields, layout)
    if layout.grain_loss:
        kernels.add_grain_losses = make_add_grain_losses(fields, layout)
    if on_device():
        kernels.load_sums = make_load_sums(fields, sums, layout, walls)
    return Compiled.from_kernels(key, layout, kernels, (fields, scratch, sums))


def interfaces(scene, model):
    """Rows of the table of interfaces (kernels.polydisperse)."""
    glue = scene.boundary.glue if scene.boundary.kind == "plates" else 1.0
    return interface_table(scene, model, glue, surface_of(scene))
