"""Declaration of all state: fields, checkpoint and documentation derive from it."""

from dataclasses import dataclass
from typing import NamedTuple

from dusttaichi.compute.engine import ti
from dusttaichi.compute.loops import SYNC
from dusttaichi.compute.scan import CHUNK
from dusttaichi.compute.state_variable import StateVariable
from dusttaichi.grains.kernels.contact_numbers import CURVED, list_numbers
from dusttaichi.grains.kernels.outside_kick import LAWS
from dusttaichi.grains.kernels.store import COUNTS, SPHERE, capacity, sphere_capacity

GATHERED = ("x", "v", "w")  # gathered together by contacts: adjacent in memory
# sums over all steps since the start, zero at the start of the ledger
SUMS = (
    "loss",
    "wall_loss",
    "impulse",
    "impulse_total",
    "face_work",
    "wrap_work",
    "virial",
    "wall_virial",
    "flux",
    "sphere_impulse",
    "grain_loss",
    "force_work",
)


@dataclass(frozen=True)
class GrainVariable(StateVariable):
    """A variable of the grain method (units: internal) and the shape of its field."""

    shape: tuple


class Sizes(NamedTuple):
    """Lengths and element types of the fields.

    Numbers of grains, of these and of everything that moves beside them, their chunks, blocks of
    pairs (with the sphere, too) and of wall contacts, lanes of a block; and element types of the
    numbers of a contact and a grain.
    """

    grains: int
    moving: int
    chunks: int
    pairs: int
    walls: int
    width: int
    law: tuple
    geometry: str


def declare(grains, layout, walls):
    """All state of a scene of `grains` grains: a list of GrainVariable."""
    pairs, wall_blocks = capacity(grains, layout, walls)
    pairs += sphere_capacity(grains, layout)
    moving = grains + SPHERE + layout.sphere  # two far-away grains that fill the empty lanes
    chunks, law, geometry = -(-grains // CHUNK), (layout.law_name, 0), layout.geometry_name
    n = Sizes(grains, moving, chunks, pairs, wall_blocks, layout.width, law, geometry)
    rows = [*_grains(n), *_contacts(n, layout)]
    rows += _walls(n, layout) if walls else []
    rows += _surfaces(layout) if layout.curved else []
    rows += _orientation(n) if layout.orientation else []
    rows += _grain_loss(n, layout) if layout.grain_loss else []
    rows += _members(n) if layout.members else []
    rows += _cell(n, layout) if layout.periodic else []
    rows += [*_pushes(n, layout), *_forces(n, layout)]
    rows += _sphere(n) if layout.sphere else []
    rows += _polydisperse(n) if layout.polydisperse else []
    rows += _stress(n, layout, walls) if layout.stress else []
    return [GrainVariable(*row) for row in rows]


# fmt: off
def _grains(n):
    moving = (n.moving,)
    return [
        ("x", "positions", "um", (n.geometry, 3), moving),
        ("v", "velocities half a step back", "um/us", (n.geometry, 3), moving),
        ("w", "spins half a step back", "rad/us", (n.geometry, 3), moving),
        ("x_search", "positions at the last search", "um", (n.geometry, 3), moving),
    ]


def _orientation(n):
    meaning = "rotation since the start, a quaternion w x y z"
    return [("orientation", meaning, "1", (n.geometry, 4), (n.grains,))]


def _grain_loss(n, layout):
    meaning = "losses in the contacts of a grain up to the last search, by channel"
    return [("grain_loss", meaning, "fJ", ("f64", 0), (n.grains, len(layout.channels)))]


def _members(n):
    return [
        ("body", "twice the number of its member, plus 1 in the second body; -1 at rest", "1",
         ("i32", 0), (n.grains,)),
        ("origin", "origin of its member, as the search sees it", "um", ("f64", 3), (n.grains,)),
        ("member_first", "first grain of a member", "1", ("i32", 0), (n.grains // 2 + 2,)),
        ("due", "1 where the member is to be measured, 2 with its contacts", "1",
         ("i32", 0), (n.grains // 2 + 1,)),
    ]


def _contacts(n, layout):
    blocks, tiles = n.pairs + n.walls, n.pairs // layout.tile
    entries = (2 * n.pairs + n.walls) * layout.width + n.grains
    kinds = CURVED + len(layout.curved)
    numbers = ("constants of a contact of two grains, with a wall, with the sphere, with surfaces",
               "um, nN, fJ", n.law, (kinds, len(list_numbers(layout.model))))
    return [
        ("contact", "history and own constants of a contact: rows of the layout",
         "um, nN, fJ", n.law, (blocks, layout.row_count, n.width)),
        ("load", "force on the first body of a contact, torques on both, force on the second",
         "nN, nN um", n.law,
         (blocks, layout.load_rows, n.width)),
        ("pair_i", "first grain of a pair", "1", ("i32", 0), (n.pairs, n.width)),
        ("pair_j", "second grain of a pair", "1", ("i32", 0), (n.pairs, n.width)),
        ("pair_start", "first pair of a grain", "1", ("i32", 0), (n.grains + 1,)),
        ("numbers", *numbers),
        ("touches", "distance of the centres at first touch of these", "um", ("f64", 0), (kinds,)),
        ("entry_start", "first contact of a grain's list", "1", ("i32", 0), (n.grains + 1,)),
        ("entry", "contacts of a grain, -1 at the end: kernels.list_entries", "1", ("i32", 0),
         (entries,)),
        # sums over many steps are in double precision always
        ("loss", "losses by tile", "fJ", ("f64", 0), (tiles, len(layout.channels))),
        ("sync", "meeting places of the workers", "1", ("i32", 0), (SYNC,)),
        ("counts", "numbers of contacts and their room", "1", ("i32", 0), (COUNTS,)),
    ]


def _walls(n, layout):
    tiles = n.walls // layout.tile
    return [
        ("wall_grain", "grain of a wall contact", "1", ("i32", 0), (n.walls, n.width)),
        ("wall_gap", "0, or far away in an empty lane", "um", ("f64", 0), (n.walls, n.width)),
        ("wall_of", "wall of a block", "1", ("i32", 0), (n.walls,)),
        ("wall_slot", "lane of a grain on a wall, or -1", "1", ("i32", layout.surfaces),
         (n.grains,)),
        ("wall_loss", "wall losses by tile", "fJ", ("f64", 0), (tiles, len(layout.channels))),
        ("impulse", "time integral of the wall force by block, of surfaces also of their pressing "
         "and their power", "nN us, fJ", ("f64", 0), (n.walls, layout.impulses)),
        ("impulse_total", "the same before the last search", "nN us, fJ", ("f64", layout.impulses),
         (layout.surfaces,)),
    ]


def _surfaces(layout):
    shape = len(layout.curved), layout.curved.row_length
    meaning = "numbers of the surfaces and how they move: physics.surfaces.surface_model"
    return [("surfaces", meaning, "um, us", ("f64", 0), shape)]


def _cell(n, layout):
    tiles, axes = n.pairs // layout.tile, len(layout.periodic)
    return [
        ("shift", "edges between a pair, along each periodic axis", "1", ("f64", 0),
         (n.pairs, axes, n.width)),
        ("wraps", "how often a grain has crossed a face", "1", ("i32", 3), (n.grains,)),
        ("cell", "edges: kernels.cell_kinematics", "um, um/us, 1/us", ("f64", 0), (5, 3)),
        ("face_work", "work of the faces by tile", "fJ", ("f64", 0), (tiles,)),
        ("wrap_work", "energy given to grains that crossed, by chunk", "fJ", ("f64", 0),
         (n.chunks,)),
    ]


def _pushes(n, layout):
    impulse = "time integral of the force on a carried grain"
    forced = [("push_force", "force from outside on a grain", "nN", ("f64", 3), (n.grains,))]
    carried = [
        ("free", "1, or 0 for a grain that is carried", "1", ("f64", 0), (n.grains,)),
        ("carried_impulse", impulse, "nN us", ("f64", 3), (n.grains,)),
    ]
    return forced * layout.forced + carried * layout.carried


def _forces(n, layout):
    model, moving = layout.forces, (n.moving,)
    rows = [("forces", "masses and numbers of the laws: kernels.outside_kick", "um, us, pg",
             ("f64", 0), (LAWS + model.width,))]
    powers = [("force_work", "work of the forces by the powers that are summed", "fJ", ("f64", 0),
               (n.moving, max(1, len(model.powers))))]
    charge = [("charge", "charge of a particle", "C", ("f64", 0), moving)]
    script = [("script_force", "force that a script sets", "nN", ("f64", 3), moving)]
    rows += powers * bool(model.powers) + charge * model.charged + script * model.scripted
    return rows * bool(model)


def _sphere(n):
    meaning = "time integrals of force and torque of the grains on the sphere"
    return [
        ("sphere_slot", "lane of a grain on the sphere, or -1", "1", ("i32", 0), (n.grains,)),
        ("sphere_body", "one over its mass and over its moment of inertia, 0 where it is driven",
         "1/pg, 1/(pg um^2)", ("f64", 0), (2,)),
        ("sphere_impulse", meaning, "nN us, nN um us", ("f64", 0), (6,)),
    ]


def _polydisperse(n):
    # of the two that fill empty lanes only the motion is needed
    return [
        ("radius", "radius of a grain", "um", ("f64", 0), (n.moving,)),
        ("mass", "mass of a grain", "pg", ("f64", 0), (n.moving,)),
        ("inertia", "moment of inertia of a grain", "pg um^2", ("f64", 0), (n.grains,)),
        ("material", "number of its material", "1", ("i32", 0), (n.grains,)),
        ("touch", "distance of the centres of a contact at first touch", "um", ("f64", 0),
         (n.pairs + n.walls, n.width)),
    ]


def _stress(n, layout, walls):
    branches, unit = "time integral of branch x force by tile", "nN um us"
    tiles, wall_tiles = n.pairs // layout.tile, n.walls // layout.tile
    on_walls = [("wall_virial", branches, unit, ("f64", 0), (wall_tiles, 9))]
    return [
        ("virial", branches, unit, ("f64", 0), (tiles, 9)),
        ("flux", "time integral of v v by chunk: xx xy xz yy yz zz", "um^2/us", ("f64", 0),
         (n.chunks, 6)),
        *(on_walls if walls else []),
    ]
# fmt: on


def place(variables, by_columns=False):
    """Taichi fields for the declared variables, as a dict by name.

    by_columns: a number of all blocks is side by side in memory, as threads of a device read it;
    else all numbers of a block are.
    """
    together = [var for var in variables if var.name in GATHERED]
    # contacts first: their blocks then begin where lines of the cache do
    further = sorted((v for v in variables if v not in together), key=lambda v: -len(v.shape))
    fields = {}
    for var in further:
        order = {"order": "jik"} if by_columns and len(var.shape) == 3 else {}
        fields[var.name] = var.field(shape=var.shape, **order)
    gathered = {var.name: var.field() for var in together}
    ti.root.dense(ti.i, together[0].shape[0]).place(*gathered.values())
    return gathered | fields
