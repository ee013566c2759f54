"""Places of the numbers of a scene in memory: lanes, blocks, tiles, and their counts.

Contacts are in blocks of W lanes, pairs first (sorted by grain), then walls (each block touches one
wall only). A tile is a fixed run of blocks that one worker passes at a time: losses are summed tile
by tile, so that no sum depends on the number of threads. Contacts with the one rigid sphere that a
scene may have are pairs in blocks of their own, between those of the grains and the walls.

The numbers of a contact are rows of two fields: `contact`, its history and where grains differ its
constants, whose order and widths follow from the declarations of the effects, and `load`. The
grains read the loads alone: those of neighbouring contacts are side by side.
"""

from dataclasses import dataclass
from functools import cached_property

from dusttaichi.compute.backend import SMALL
from dusttaichi.compute.engine import ti
from dusttaichi.physics.contact.model import ContactModel
from dusttaichi.physics.forces.model import ForceModel
from dusttaichi.physics.surfaces.surface_model import SurfaceModel

NEIGHBOURS = 24  # neighbours of a grain within the skin that the search can hold
PAIRS_PER_GRAIN = 6  # twelve touching neighbours at most
# places in the `counts` field: what a search has found, and the size of the scene, which kernels
# do not know when they are compiled
PAIRS, WALL_BLOCKS, OVERFLOW, GRAINS, PAIR_ROOM, FIRST_WALL, WALL_ROOM = range(7)
ON_SPHERE, FIRST_SPHERE = 7, 8  # contacts with the sphere, and their first block
WALL_SECTIONS = 9  # see `wall_sections`
COUNTS = 10
PLANES = 6  # walls that are planes: those of curved surfaces stand behind them
SPHERE = 2  # number of the sphere behind the grains: two that fill empty lanes stand before it
LOADS = 9  # force on the first body of a contact, torques on both
OPPOSITE = 9  # first row of the force on the second body


@dataclass(frozen=True)
class Layout:
    """Options of a scene that are compiled in, and the rows of the fields of contacts."""

    width: int  # lanes of a block
    tile: int  # blocks of a tile
    model: ContactModel
    periodic: tuple = ()  # numbers of the axes along which the cell repeats
    tilted: bool = False  # the cell may be tilted: its image above moves along x
    stress: bool = False
    forced: bool = False  # a force from outside acts on some grains
    carried: bool = False  # some grains move at a speed of their own
    sphere: bool = False  # there is a rigid sphere among the grains
    curved: SurfaceModel = SurfaceModel()  # surfaces behind the six planes
    forces: ForceModel = ForceModel()  # from outside
    stored: tuple = ()  # numbers of each contact, where grains have their own radius and material
    precision: str = "f64"
    ledger: bool = True  # only a benchmark does without
    orientation: bool = False  # rotations of the grains are followed
    contact_loss: bool = False  # what each contact has lost is stored with it
    grain_loss: bool = False  # what the contacts of each grain have lost is summed for it
    members: bool = False  # independent pairs of bodies side by side (kernels.members)
    few_wall_contacts: bool = False  # few of many grains reach the walls: a smaller capacity

    @property
    def polydisperse(self):
        """True if grains have their own radius and material (kernels.polydisperse)."""
        return bool(self.stored)

    @property
    def surfaces(self):
        """Number of walls that kernels have places for."""
        return PLANES + len(self.curved)

    @property
    def impulses(self):
        """Numbers of a wall that are summed over time: see SurfaceGatherer.load_of."""
        return 5 if self.curved else 3

    @property
    def geometry(self):
        """Float type of positions, velocities and spins."""
        return ti.f32 if self.precision == "f32" else ti.f64

    @property
    def law(self):
        """Float type of contacts: their history, their numbers, their loads."""
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
    def channels(self):
        """Names of the channels of the ledger: of contacts, then of forces from outside."""
        return tuple(dict.fromkeys((*self.model.channels, *self.forces.channels)))

    @cached_property
    def rows(self):
        """Name -> (first row, rows) of the numbers of a contact.

        `lost`: its losses since it formed, one a channel, where they are followed; `recent`: those
        since the last search, which breaking leaves as they are, where grains are followed.
        """
        widths = {name: history.components for name, history in self.model.history.items()}
        if self.contact_loss:
            widths["lost"] = len(self.channels)
        if self.grain_loss:
            widths["recent"] = len(self.channels)
        out, first = {}, 0
        for name, width in widths.items():
            out[name] = (first, width)
            first += width
        return out

    @property
    def state_rows(self):
        """Rows of the state of a contact."""
        return sum(width for _, width in self.rows.values())

    @property
    def history_rows(self):
        """Rows of what a contact forgets when it breaks."""
        return self.rows["recent"][0] if self.grain_loss else self.state_rows

    @property
    def load_rows(self):
        """Rows of the loads, with places for the history: the search puts the old lists there."""
        return max(OPPOSITE + 3 if self.opposite else LOADS, self.state_rows)

    @property
    def opposite(self):
        """True if the force on the second body of a contact has rows of its own."""
        return self.width > 1

    @property
    def constants(self):
        """First row of its constants, where grains differ."""
        return self.state_rows

    @property
    def row_count(self):
        """Rows of the state and constants of a contact."""
        return self.constants + len(self.stored)

    @property
    def mask(self):
        """Largest number of a block that 31 bits can address.

        It shows the compiler that no address of a block overflows. A thread of a device has one
        block, and needs none.
        """
        if self.width == 1:
            return 2**31 - 1
        rows = max(self.row_count, self.load_rows)
        return 2 ** (31 - (rows * self.width - 1).bit_length()) - 1


def sizes(grains, layout, walls):
    """The `counts` of a scene in which no search has been yet."""
    pair_blocks, wall_blocks = capacity(grains, layout, walls)
    first_wall = pair_blocks + sphere_capacity(grains, layout)
    room = pair_blocks * layout.width
    sections = wall_sections(grains)
    return [0, 0, 0, grains, room, first_wall, wall_blocks, 0, pair_blocks, sections]


def capacity(grains, layout, walls):
    """Capacity in blocks of pairs and of wall contacts, whole tiles both.

    Twelve neighbours touch a grain at most.
    """
    per_tile = layout.width * layout.tile
    pairs = PAIRS_PER_GRAIN * grains + 64
    contacts = wall_contacts(grains, layout.few_wall_contacts)
    lanes = contacts + layout.surfaces * layout.width * wall_sections(grains)
    pair_blocks = -(-pairs // per_tile) * layout.tile
    return pair_blocks, -(-lanes // per_tile) * layout.tile if walls else 0


def wall_contacts(grains, few):
    """Capacity in contacts with walls.

    A wall is touched by a face of the sample: every grain of a small or flat one, a share that
    shrinks as N^(-1/3) of a large one. few: the walls are so small that no more contacts fit on
    them (`dusttaichi.grains.layout_choice.has_few_wall_contacts`).
    """
    faces = int(20 * grains ** (2 / 3)) + 64
    return faces if few else min(6 * grains, grains + faces)


def wall_sections(grains):
    """Number of parts of the grains whose contacts with walls are adjacent.

    A worker passes the contacts of its own grains. Each costs some three blocks more, as no block
    is of two walls.
    """
    return next(
        n for n, largest in ((1, SMALL), (2, 8192), (4, 32768), (8, grains)) if grains <= largest
    )


def sphere_capacity(grains, layout):
    """Blocks of contacts with the sphere, whole tiles: every grain may touch it."""
    per_tile = layout.width * layout.tile
    return -(-grains // per_tile) * layout.tile if layout.sphere else 0
