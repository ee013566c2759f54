"""Compiled fields and kernels of a layout of grains."""

from collections.abc import Callable
from dataclasses import dataclass, fields

from dusttaichi.compute.blocks import on_device
from dusttaichi.compute.compiled import Compiled
from dusttaichi.compute.engine import ti
from dusttaichi.compute.loops import advance_by
from dusttaichi.grains.kernels import search
from dusttaichi.grains.kernels.cell import make_wrap
from dusttaichi.grains.kernels.declare import declare, place
from dusttaichi.grains.kernels.device import by_threads
from dusttaichi.grains.kernels.grain_losses import make_add_grain_losses
from dusttaichi.grains.kernels.load_sums import make_load_sums, place_load_sums
from dusttaichi.grains.kernels.measure import make_measure, place_measure
from dusttaichi.grains.kernels.neighbour_lists import make_neighbour_lists
from dusttaichi.grains.kernels.polydisperse import interface_table, make_write_constants
from dusttaichi.grains.kernels.sphere import make_sphere_relist
from dusttaichi.grains.sphere import surface_of
from dusttaichi.grains.step import Phases, make_evaluate, steps_of


@dataclass(frozen=True)
class Kernels:
    """The kernels of a scene; None what it does not have."""

    advance: Callable
    evaluate: Callable
    bounds: Callable
    list_neighbours: Callable
    relist_sphere: Callable | None
    list_entries: Callable | None
    wrap: Callable | None
    load_sums: Callable | None
    add_grain_losses: Callable | None
    measure_grains: Callable
    measure_pairs: Callable
    measure_walls: Callable | None
    measure_sphere: Callable | None

    @property
    def names(self):
        """Names of those that the scene has."""
        return [f.name for f in fields(self) if getattr(self, f.name) is not None]


def compiled_for(key, scene, layout, room):
    """The Compiled of a layout for `room` grains, and the kind of loops that is last in its key.

    Taichi runs.
    """
    walls, kind = bool(scene.boundary.walls), key[-1]
    fields = place(declare(room, layout, walls), by_columns=kind == "launches")
    scratch = search.place_search(room, layout, walls)
    sums = place_measure(room, layout, walls)
    sums |= place_load_sums(room, layout, walls) if on_device() else {}
    write = None
    if layout.polydisperse:
        shape = interfaces(scene, layout.model).shape
        table = scratch["interfaces"] = ti.field(ti.f64, shape=shape)
        write = make_write_constants(fields, table, scene, layout)
    list_neighbours, list_entries = make_neighbour_lists(
        fields, scratch, layout, walls=walls, write_constants=write
    )
    phases = Phases(fields, layout, walls)
    own = steps_of(phases)
    grain_sums, pair_sums, wall_sums, sphere_sums = make_measure(fields, sums, layout, phases)
    kernels = Kernels(
        advance=advance_by(kind, own, lambda: by_threads(phases, layout, own)),
        evaluate=make_evaluate(phases),
        bounds=search.make_bounds(fields, scratch),
        list_neighbours=list_neighbours,
        relist_sphere=make_sphere_relist(fields, scratch, layout, write) if layout.sphere else None,
        list_entries=list_entries,
        wrap=make_wrap(fields, layout) if layout.periodic else None,
        load_sums=make_load_sums(fields, sums, layout, walls) if on_device() else None,
        add_grain_losses=make_add_grain_losses(fields, layout) if layout.grain_loss else None,
        measure_grains=grain_sums,
        measure_pairs=pair_sums,
        measure_walls=wall_sums,
        measure_sphere=sphere_sums,
    )
    return Compiled.of(key, layout, kernels, (fields, scratch, sums))


def interfaces(scene, model):
    """Rows of the table of interfaces (kernels.polydisperse)."""
    glue = scene.boundary.glue if scene.boundary.kind == "plates" else 1.0
    return interface_table(scene, model, glue, surface_of(scene))
