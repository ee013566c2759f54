"""The choice of what is compiled in: the Layout that a scene needs."""

import numpy as np

from dusttaichi.compute.memory import COARSE
from dusttaichi.domain.domain import lengths
from dusttaichi.grains.kernels import store
from dusttaichi.grains.kernels.polydisperse import list_stored_numbers
from dusttaichi.grains.outside_forces import choose_model
from dusttaichi.grains.surface_placement import choose_surfaces
from dusttaichi.physics.geometry import AXES


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
