"""How the numbers of a scene stand in memory: lanes, blocks, tiles, and how many of them.

Contacts stand in blocks of W lanes, pairs first (sorted by grain), then walls (each block touches
one wall only). A tile is a fixed run of blocks that one worker passes at a time: losses are summed
tile by tile, so that no sum depends on the number of threads. Contacts with the one rigid sphere
that a scene may have are pairs in blocks of their own, between those of the grains and the walls.
"""

from dataclasses import dataclass

import taichi as ti

from dusttaichi.compute.backend import SMALL
from dusttaichi.names import CHANNELS, EXTRA_CHANNELS

NEIGHBOURS = 24  # neighbours of a grain within the skin that the search can hold
PAIRS_PER_GRAIN = 6  # twelve touching neighbours at most
# places in the `counts` field: what a search has found, and the size of the scene, which kernels
# do not know when they are compiled
PAIRS, WALL_BLOCKS, OVERFLOW, GRAINS, PAIR_ROOM, FIRST_WALL, WALL_ROOM = range(7)
ON_SPHERE, FIRST_SPHERE = 7, 8  # contacts with the sphere, and their first block
WALL_SECTIONS = 9  # see `wall_sections`
COUNTS = 10
SPHERE = 2  # number of the sphere behind the grains: two that fill empty lanes stand before it


@dataclass(frozen=True)
class Layout:
    """Where the numbers of a contact stand; what a scene does not need has no place (-1)."""

    width: int  # lanes of a block
    tile: int  # blocks of a tile
    twisting: bool
    damping: bool
    periodic: tuple = ()  # numbers of the axes along which the cell repeats
    tilted: bool = False  # the cell may lean: its image above moves along x
    stress: bool = False
    asperities: bool = False
    forced: bool = False  # a force from outside acts on some grains
    carried: bool = False  # some grains move at a speed of their own
    sphere: bool = False  # there is a rigid sphere among the grains
    gravity: str = ""  # or constant, central
    batch: bool = False  # many scenes at once, whose grains do not see each other
    stored: tuple = ()  # numbers of each contact, where grains have their own radius and material
    precision: str = "f64"
    ledger: bool = True  # only a benchmark does without
    orientation: bool = False  # rotations of the grains are followed
    contact_loss: bool = False  # what each contact has lost is kept with it
    thick: bool = False  # so few of many grains reach the walls that less room is left for them

    @property
    def polydisperse(self):
        """Whether grains have their own radius and material (kernels.polydisperse)."""
        return bool(self.stored)

    @property
    def falls(self):
        """Whether there is gravity."""
        return self.gravity != ""

    @property
    def deviations(self):
        """Whether contacts keep deviations (physics.contact.deviation) in place of pointers."""
        return self.precision == "mixed"

    @property
    def geometry(self):
        """Float type of positions, velocities and spins."""
        return ti.f32 if self.precision == "f32" else ti.f64

    @property
    def law(self):
        """Float type of contacts: what they keep, their numbers, their loads."""
        return ti.f64 if self.precision == "f64" else ti.f32

    @property
    def geometry_name(self):
        """Name of the type `geometry`."""
        return "f32" if self.precision == "f32" else "f64"

    @property
    def law_name(self):
        """Name of the type `law`."""
        return "f64" if self.precision == "f64" else "f32"

    @property
    def first(self):
        return 0  # n1, or e1: 0 1 2

    @property
    def second(self):
        return 3  # n2 of a pair, foot of a wall contact; or e2, zeta: 3 4 5

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
    def touched(self):
        """1 where a contact touches: a deviation of zero does not tell."""
        return self.state_size - 1 if self.deviations else -1

    @property
    def tile_columns(self):
        """Sums over a tile and step: losses, virial, work of the faces."""
        return len(self.channels) + 9 * self.stress + bool(self.periodic)

    @property
    def lost(self):
        """Losses of the contact since it formed, one a channel."""
        return 6 + self.twisting + 2 * self.damping + 2 * self.asperities

    @property
    def state_size(self):
        return self.lost + self.contact_loss * len(self.channels) + self.deviations

    @property
    def channels(self):
        """Names of the channels of the ledger."""
        return CHANNELS + EXTRA_CHANNELS[: int(self.asperities)]


def sizes(grains, layout, walls):
    """The `counts` of a scene in which no search has been yet."""
    pair_blocks, wall_blocks = capacity(grains, layout, walls)
    first_wall = pair_blocks + sphere_capacity(grains, layout)
    room = pair_blocks * layout.width
    sections = wall_sections(grains)
    return [0, 0, 0, grains, room, first_wall, wall_blocks, 0, pair_blocks, sections]


def capacity(grains, layout, walls):
    """Blocks of pairs and of wall contacts that there is room for, whole tiles both.

    Twelve neighbours touch a grain at most.
    """
    per_tile = layout.width * layout.tile
    pairs = PAIRS_PER_GRAIN * grains + 64
    lanes = wall_contacts(grains, layout.thick) + 6 * layout.width * wall_sections(grains)
    pair_blocks = -(-pairs // per_tile) * layout.tile
    return pair_blocks, -(-lanes // per_tile) * layout.tile if walls else 0


def wall_contacts(grains, thick):
    """Contacts with walls that there is room for.

    A wall is touched by a face of the sample: every grain of a small or flat one, a share that
    shrinks as N^(-1/3) of a large one. A thick one (`dusttaichi.grains.build.is_thick`) has walls
    so small that no more than these find place on them.
    """
    faces = int(20 * grains ** (2 / 3)) + 64
    return faces if thick else min(6 * grains, grains + faces)


def wall_sections(grains):
    """Parts of the grains whose contacts with walls stand together, so that a worker passes those
    of its own grains. Each costs some three blocks more, as no block is of two walls."""
    return next(n for n, most in ((1, SMALL), (2, 8192), (4, 32768), (8, grains)) if grains <= most)


def sphere_capacity(grains, layout):
    """Blocks of contacts with the sphere, whole tiles: every grain may touch it."""
    per_tile = layout.width * layout.tile
    return -(-grains // per_tile) * layout.tile if layout.sphere else 0
