"""What a simulation holds, declared once: fields, checkpoint and documentation derive from it.

Contacts stand in blocks of W lanes, pairs first (sorted by grain), then walls (each block touches
one wall only). A tile is a fixed run of blocks that one worker passes at a time: losses are summed
tile by tile, so that no sum depends on the number of threads.
"""

from dataclasses import dataclass
from math import floor, log2

import taichi as ti

from dusttaichi.names import CHANNELS, EXTRA_CHANNELS

GATHERED = ("x", "v", "w")  # gathered together by contacts: they stand side by side in memory
CHUNK = 256  # grains of a chunk: the unit of the parallel scans and of the grain sums
NEIGHBOURS = 24  # neighbours of a grain within the skin that the search can hold
PAIRS_PER_GRAIN = 6  # twelve touching neighbours at most
SMALLEST_ROOM = 1024  # grains
COARSE = 16384  # grains up to which rooms grow fourfold
# sums over all steps since the start: what begins at zero with the ledger
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
)
# places in the `counts` field: what a search has found, and the size of the scene, which kernels
# do not know when they are compiled
PAIRS, WALL_BLOCKS, OVERFLOW, GRAINS, PAIR_ROOM, FIRST_WALL, WALL_ROOM = range(7)


@dataclass(frozen=True)
class Layout:
    """Where the numbers of a contact stand; what a scene does not need has no place (-1)."""

    width: int  # lanes of a block
    tile: int  # blocks of a tile
    twisting: bool
    damping: bool
    periodic: tuple = ()  # numbers of the axes along which the cell repeats
    stress: bool = False
    asperities: bool = False
    forced: bool = False  # a force from outside acts on some grains
    carried: bool = False  # some grains move at a speed of their own
    batch: bool = False  # many scenes at once, whose grains do not see each other
    stored: tuple = ()  # numbers of each contact, where grains have their own radius and material
    precision: str = "f64"
    ledger: bool = True  # only a benchmark does without

    @property
    def polydisperse(self):
        """Whether grains have their own radius and material (kernels.polydisperse)."""
        return bool(self.stored)

    @property
    def geometry(self):
        """Float type of positions, velocities, pointers and what is formed from them: overlaps and
        displacements are small differences of these."""
        return ti.f32 if self.precision == "f32" else ti.f64

    @property
    def law(self):
        """Float type of the forces, which are functions of overlaps and displacements."""
        return ti.f64 if self.precision == "f64" else ti.f32

    @property
    def element(self):
        """Name of the element type of what is of type `geometry`."""
        return "f32" if self.precision == "f32" else "f64"

    @property
    def pointer(self):
        return 0  # n1: 0 1 2

    @property
    def second(self):
        return 3  # n2 of a pair, foot point of a wall contact: 3 4 5

    @property
    def twist(self):
        return 6 if self.twisting else -1

    @property
    def approach(self):
        """Relative normal speed of the last half step, and the damping force of the last step."""
        return 6 + self.twisting if self.damping else -1

    @property
    def graze(self):
        """Speed and impulse of a first touch in the last step."""
        return 6 + self.twisting + 2 * self.damping if self.asperities else -2

    @property
    def state_size(self):
        return 6 + self.twisting + 2 * self.damping + 2 * self.asperities

    @property
    def channels(self):
        """Names of the channels of the ledger."""
        return CHANNELS + EXTRA_CHANNELS[: int(self.asperities)]


@dataclass(frozen=True)
class Variable:
    """One piece of state: name, what it is, unit (internal), element type, shape."""

    name: str
    meaning: str
    unit: str
    element: tuple  # ("f64"|"f32"|"i32"|"i64", vector length or 0)
    shape: tuple


def declare(grains, layout, walls):
    """All state of a scene of `grains` grains: a list of Variable."""
    width = layout.width
    pair_blocks, wall_blocks = capacity(grains, layout, walls)
    tiles = pair_blocks // layout.tile
    ghosts = grains + 2  # two far-away grains that fill the empty lanes
    # sums over many steps are in double precision always
    lane, lane_i, own = ("f64", width), ("i32", width), layout.element
    variables = [
        Variable("x", "positions", "um", (own, 3), (ghosts,)),
        Variable("v", "velocities half a step back", "um/us", (own, 3), (ghosts,)),
        Variable("w", "spins half a step back", "rad/us", (own, 3), (ghosts,)),
        Variable("x_search", "positions at the last search", "um", (own, 3), (ghosts,)),
        Variable("pair_i", "first grain of a pair", "1", lane_i, (pair_blocks,)),
        Variable("pair_j", "second grain of a pair", "1", lane_i, (pair_blocks,)),
        Variable("pair_start", "first pair of a grain", "1", ("i32", 0), (grains + 1,)),
        Variable(
            "state",
            "pointers, twist, approach",
            "1, rad, um/us",
            (own, width),
            (pair_blocks + wall_blocks, layout.state_size),
        ),
        Variable(
            "load",
            "force and two torques of a contact",
            "nN, nN um",
            (own, width),
            (pair_blocks + wall_blocks, max(9, layout.state_size)),
        ),  # room for a state
        Variable("entry_start", "first contact of a grain's list", "1", ("i32", 0), (grains + 1,)),
        Variable(
            "entry",
            "2 contact + side",
            "1",
            ("i32", 0),
            (pair_blocks * width * 2 + wall_blocks * width,),
        ),
        Variable("loss", "losses by tile", "fJ", lane, (tiles, len(layout.channels))),
        Variable("sync", "meeting places of the workers", "1", ("i32", 0), (8,)),
        Variable("counts", "numbers of contacts and their room", "1", ("i32", 0), (7,)),
    ]
    if walls:
        variables += [
            Variable("wall_grain", "grain of a wall contact", "1", lane_i, (wall_blocks,)),
            Variable("wall_gap", "0, or far away in an empty lane", "um", lane, (wall_blocks,)),
            Variable("wall_of", "wall of a block", "1", ("i32", 0), (wall_blocks,)),
            Variable("wall_slot", "lane of a grain on a wall, or -1", "1", ("i32", 6), (grains,)),
            Variable(
                "wall_loss",
                "wall losses by tile",
                "fJ",
                lane,
                (wall_blocks // layout.tile, len(layout.channels)),
            ),
            Variable(
                "impulse",
                "time integral of the wall force by block",
                "nN us",
                lane,
                (wall_blocks, 3),
            ),
            Variable("impulse_total", "the same before the last search", "nN us", ("f64", 3), (6,)),
        ]
    if layout.batch:
        variables.append(Variable("scene", "number of the scene", "1", ("i32", 0), (grains,)))
    if layout.periodic:
        variables += [
            Variable(
                "shift",
                "edges between a pair, along each periodic axis",
                "1",
                lane,
                (pair_blocks, len(layout.periodic)),
            ),
            Variable("wraps", "how often a grain has crossed a face", "1", ("i32", 3), (grains,)),
            Variable(
                "cell",
                "how the edges go: rows of kernels.cell",
                "um, um/us, 1/us",
                ("f64", 0),
                (4, 3),
            ),
            Variable("face_work", "work of the faces by tile", "fJ", lane, (tiles,)),
            Variable(
                "wrap_work",
                "energy given to grains that crossed, by chunk",
                "fJ",
                ("f64", 0),
                (-(-grains // CHUNK),),
            ),
        ]
    if layout.forced:
        variables.append(
            Variable("push_force", "force from outside on a grain", "nN", ("f64", 3), (grains,))
        )
    if layout.carried:
        variables += [
            Variable("free", "1, or 0 for a grain that is carried", "1", ("f64", 0), (grains,)),
            Variable(
                "held",
                "time integral of the force on a carried grain",
                "nN us",
                ("f64", 3),
                (grains,),
            ),
        ]
    if layout.polydisperse:
        # of the ghosts nothing but the motion is asked
        one = ("f64", 0)
        variables += [
            Variable("radius", "radius of a grain", "um", one, (grains,)),
            Variable("mass", "mass of a grain", "pg", one, (grains,)),
            Variable("inertia", "moment of inertia of a grain", "pg um^2", one, (grains,)),
            Variable("material", "number of its material", "1", ("i32", 0), (grains,)),
            Variable(
                "constants",
                "numbers of a contact: the layout's `stored`",
                "um, nN, fJ",
                lane,
                (pair_blocks + wall_blocks, len(layout.stored)),
            ),
        ]
    if layout.stress:
        variables += [
            Variable(
                "virial", "time integral of branch x force by tile", "nN um us", lane, (tiles, 9)
            ),
            Variable(
                "flux",
                "time integral of v v by chunk: xx xy xz yy yz zz",
                "um^2/us",
                ("f64", 0),
                (-(-grains // CHUNK), 6),
            ),
        ]
        if walls:
            variables.append(
                Variable(
                    "wall_virial",
                    "time integral of branch x force by tile",
                    "nN um us",
                    lane,
                    (wall_blocks // layout.tile, 9),
                )
            )
    return variables


def room_for(grains):
    """Grains that the fields of a scene of this many grains have room for.

    Kernels are compiled for the shapes of their fields, so scenes of one room share them. Rooms are
    coarse where memory is nothing, and a quarter too large at most where it counts.
    """
    room = SMALLEST_ROOM
    while room < grains and room < COARSE:
        room *= 4
    if room >= grains:
        return room
    step = 2 ** (floor(log2(grains)) - 2)
    return -(-grains // step) * step


def sizes(grains, layout, walls):
    """The `counts` of a scene in which no search has been yet."""
    pair_blocks, wall_blocks = capacity(grains, layout, walls)
    return [0, 0, 0, grains, pair_blocks * layout.width, pair_blocks, wall_blocks]


def capacity(grains, layout, walls):
    """Blocks of pairs and of wall contacts that there is room for, whole tiles both.

    Twelve neighbours touch a grain at most. A wall is touched by a face of the sample: every grain
    of a small or flat one, a share that shrinks as N^(-1/3) of a large one.
    """
    per_tile = layout.width * layout.tile
    pairs = PAIRS_PER_GRAIN * grains + 64
    lanes = min(6 * grains, grains + int(20 * grains ** (2 / 3)) + 64) + 6 * layout.width
    pair_blocks = -(-pairs // per_tile) * layout.tile
    return pair_blocks, -(-lanes // per_tile) * layout.tile if walls else 0


def place(variables):
    """Taichi fields for the declared variables, as a dict by name."""
    types = {"f64": ti.f64, "f32": ti.f32, "i32": ti.i32, "i64": ti.i64}
    together = [var for var in variables if var.name in GATHERED]
    fields = {var.name: ti.Vector.field(3, types[var.element[0]]) for var in together}
    ti.root.dense(ti.i, together[0].shape[0]).place(*fields.values())
    for var in variables:
        if var.name in fields:
            continue
        dtype, length = types[var.element[0]], var.element[1]
        make = ti.field if length == 0 else _vector_field(length)
        fields[var.name] = make(dtype, shape=var.shape)
    return fields


def _vector_field(length):
    return lambda dtype, shape: ti.Vector.field(length, dtype, shape=shape)
