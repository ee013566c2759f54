"""Build a simulation from a scene and a sample, and choose what is compiled."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dusttaichi import samples, units
from dusttaichi.compute.backend import Loops, loops_of, threads_of
from dusttaichi.compute.compiled import STRUCTURES
from dusttaichi.domain.domain import Domain
from dusttaichi.grains.compiled_grains import choose_kernels, choose_numbers
from dusttaichi.grains.contact_table import ContactTable
from dusttaichi.grains.grain_engine import DIFFERING, PREFIX, SAMPLE, GrainEngine
from dusttaichi.grains.grain_properties import (
    equal_properties,
    grain_properties,
    scale_materials,
)
from dusttaichi.grains.kernels import store
from dusttaichi.grains.kernels.declare import declare
from dusttaichi.grains.kernels.store import Layout
from dusttaichi.grains.layout_choice import choose_layout, has_few_wall_contacts
from dusttaichi.grains.order import order_by_members, rank_of
from dusttaichi.grains.outside_forces import OutsideForces, make_forces
from dusttaichi.grains.placement import describe_images, is_tilted, place_environment
from dusttaichi.grains.pushes import Push, make_push
from dusttaichi.grains.rigid_sphere import RigidSphere, place_sphere
from dusttaichi.grains.single_precision import check_precision
from dusttaichi.grains.state import GrainProperties
from dusttaichi.grains.surface_placement import place_surfaces
from dusttaichi.grains.surfaces_in_cells import check_in_cell
from dusttaichi.grains.time_step import TimeStep, chosen_step
from dusttaichi.physics.contact import constants
from dusttaichi.physics.contact.effect_registry import chosen_model
from dusttaichi.scene.push import list_stage_pushes


@dataclass(frozen=True)
class Prepared:
    """A scene and its sample before anything is compiled: input of a GrainEngine.

    scene: `grain_properties.scale_materials`. pushed_sample: `samples.apply_pushes`; sample: the
    same with its measures in the cell. order (N,): numbers of the grains in the sample, in internal
    order. domain: at rest, internal units. skin: of the search [um], None as it suits.
    """

    scene: Any
    sample: Any
    pushed_sample: Any
    properties: GrainProperties
    order: np.ndarray
    step: TimeStep
    domain: Domain
    sphere: RigidSphere | None
    forces: OutsideForces | None
    push: Push
    contact_table: ContactTable
    skin: float | None
    threads: int
    loops: Loops
    layout: Layout


def build(scene, sample, *, loops=None, ledger=True, step=None):
    """GrainEngine of a scene with a Sample, with its contacts and loads.

    loops: backend.Loops other than those of the backend, to compare them. ledger: False leaves the
    losses out, to measure their run time. step: a TimeStep instead of that of the scene, stable or
    not. The engine built before must not be used any more: its fields and kernels may be reused.
    Raises DustError for a sample that does not fit, or a step that cannot be stable.
    """
    preparation = prepare(scene, sample, loops=loops, ledger=ledger, step=step)
    layout, grains = preparation.layout, len(preparation.order)
    walls = preparation.domain.box is not None
    numbers, interface_rows = choose_numbers(preparation.contact_table, layout.model)
    compiled = choose_kernels(
        preparation.scene, layout, (preparation.loops.execution, grains, preparation.threads)
    )
    rows = {var.name: var.shape[0] for var in declare(grains, layout, walls)}
    tables = STRUCTURES.tables(compiled, rows)
    tables[0]["counts"].from_numpy(np.array(store.sizes(grains, layout, walls)))
    if interface_rows is not None:
        tables[1]["interfaces"].from_numpy(interface_rows)
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
    differing = grain_properties(scene, sample)
    properties = differing or equal_properties(scene.material)
    table = ContactTable(scene, differing)
    radii, overlaps = properties.radius / units.LENGTH, table.wall_overlaps() / units.LENGTH
    check_precision(scene, sample, ContactTable(scene).farthest_pair.rest_overlap)
    surfaces = place_surfaces(table, sample.positions / units.LENGTH, radii, overlaps)
    step = step or chosen_step(table, sample)
    dt = step.dt / units.TIME
    surfaces = surfaces and surfaces.with_step(dt)
    smallest, largest = float(np.min(radii)), float(np.max(radii))
    order = order_by_members(sample.positions / units.LENGTH, radii, sample.info.get("members"))
    stage_kinds = {push.kind for push in list_stage_pushes(scene)}
    push = make_push(scene.push, sample.info, rank_of(order), dt, stage_kinds)
    box, cell = place_environment(table, sample, overlaps)
    sample, tilted = describe_images(scene, sample, cell), is_tilted(scene, sample)
    check_in_cell(surfaces, cell, (sample.positions / units.LENGTH, largest), scene)
    volume = len(order) * 4.0 / 3.0 * np.pi * radii**3
    if differing is not None:
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
            polydisperse=differing is not None,
            members="members" in sample.info,
        ),
        ledger=ledger,
        tilted=tilted,
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
        sphere=place_sphere(scene, sample, differing, box),
        forces=make_forces(scene, layout.forces, sample, properties),
        push=push,
        contact_table=table,
        skin=None if skin == "auto" else skin * smallest,
        threads=threads_of(scene, len(order)),
        loops=loops,
        layout=layout,
    )
