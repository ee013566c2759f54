"""Compiled fields and kernels of a scene, shared by scenes of one compile key."""

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

from dusttaichi.compute.compiled import Compiled
from dusttaichi.compute.loops import advance_by
from dusttaichi.continuum.dust_device import by_threads
from dusttaichi.continuum.dust_step import Phases, steps_of
from dusttaichi.continuum.kernels import store
from dusttaichi.continuum.kernels.attraction import Attraction, make_potential
from dusttaichi.continuum.kernels.block_lists import Neighbours
from dusttaichi.continuum.kernels.hourglass import Hourglass
from dusttaichi.continuum.kernels.images import Images
from dusttaichi.continuum.kernels.motion import Motion
from dusttaichi.continuum.kernels.outside import make_evaluate_forces
from dusttaichi.continuum.kernels.pair_forces import Forces
from dusttaichi.continuum.kernels.particle_blocks import Blocks
from dusttaichi.continuum.kernels.particle_sums import place_sums
from dusttaichi.continuum.kernels.planes import Planes
from dusttaichi.continuum.kernels.rates import Rates
from dusttaichi.continuum.kernels.response import Response
from dusttaichi.continuum.kernels.rigid import Rigid
from dusttaichi.continuum.kernels.run_arguments import numbers_type
from dusttaichi.continuum.kernels.search_kernels import make_search, place_search
from dusttaichi.continuum.kernels.separation import Separation
from dusttaichi.continuum.kernels.smoothing import KERNELS
from dusttaichi.continuum.kernels.sum_launches import make_sums


@dataclass(frozen=True)
class Kernels:
    """The kernels of a scene, and the type of their arguments; sums: None on a CPU."""

    advance: Any
    search: Any
    potential: Any
    evaluate_forces: Any
    StepNumbers: Any
    sums: Any


def compiled_for(key, layout, capacity):
    """The Compiled of a layout; Taichi runs. The last item of its key is the kind of the loops.

    capacity: numbers of particles, list entries and ghosts (capacities).
    """
    execution = key[-1]
    fields, lists = store.place(layout, *capacity)
    lists |= place_search(fields, layout, capacity[0])
    if execution == "launches":
        lists |= place_sums(layout, capacity[0])
    f, scratch = SimpleNamespace(**fields), SimpleNamespace(**lists)
    n, StepNumbers = layout.dimension, numbers_type(layout.dimension)
    attraction = Attraction(f, scratch, n) if layout.self_gravity else None
    rigid, rates, forces = passes(f, scratch, layout, attraction)
    motion = Motion(f, scratch, layout, rigid=rigid, images=forces.images, attraction=attraction)
    phases = Phases(motion, rates, forces)
    step_phases = steps_of(phases, StepNumbers)
    advance = advance_by(execution, step_phases, lambda: by_threads(phases, step_phases))
    search = make_search(motion, rates.blocks.near)
    potential = make_potential(attraction, StepNumbers) if layout.self_gravity else None
    outside = motion.outside
    evaluate = make_evaluate_forces(outside, StepNumbers) if outside is not None else None
    sums = make_sums(f, scratch, layout, rigid) if execution == "launches" else None
    kernels = Kernels(advance, search, potential, evaluate, StepNumbers, sums)
    return Compiled.from_kernels(key, layout, kernels, (fields, lists))


def passes(f, lists, layout, attraction=None):
    """(Rigid, Rates, Forces) of a layout over fields of state and lists."""
    slope, rigid, contact = KERNELS[layout.kernel], Rigid(f, layout), None
    images = planes = None
    blocks = Blocks(f, lists, layout, Neighbours(f, lists, layout))
    if layout.rigid:
        images = Images(f, lists, blocks, layout, slope=slope, rigid=rigid)
    if layout.faces:
        planes = Planes(f, lists, blocks, images)
    if layout.separate:
        contact = Separation(f, lists, blocks, slope=slope, images=images)
    law = Response(f, lists, layout)
    hourglass = Hourglass(f, lists, blocks, slope) if layout.hourglass else None
    both = {"blocks": blocks, "images": images, "planes": planes, "hourglass": hourglass}
    rates = Rates(f, lists, layout, law=law, contact=contact, **both)
    return rigid, rates, Forces(f, lists, layout, attraction=attraction, **both)
