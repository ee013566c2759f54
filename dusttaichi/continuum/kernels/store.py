"""State of a continuum simulation, declared once: fields, checkpoint and ghosts derive from it.

Kernels compute in SI; in two dimensions the axes are x and z, and masses are per metre of depth.
Ghosts (periodic and mirror images) follow the particles in the fields that neighbours read.
"""

from dataclasses import dataclass
from typing import NamedTuple

from dusttaichi.compute.backend import THREAD_CLASSES
from dusttaichi.compute.engine import ti
from dusttaichi.compute.large_fields import place_apart
from dusttaichi.compute.loops import SYNC
from dusttaichi.compute.scan import scan_capacity
from dusttaichi.compute.state_variable import ELEMENTS, StateVariable
from dusttaichi.continuum.physics.dust_laws import DustLaws
from dusttaichi.continuum.physics.material_numbers import numbers_class
from dusttaichi.physics.forces.model import ForceModel

FACES = 6  # groups 0-5 move as a face does, those from 6 on are rigid bodies
FREE = -1  # group of dust
TINY = 1e-12  # (r/h)^2 that keeps coincident particles from dividing by zero
LEAST_GHOSTS = 4096
MOST_WORKERS = THREAD_CLASSES[-1]
APART = 8  # numbers between those of two workers in `most`: a line of the cache
BODIES = 16  # largest number of rigid bodies
MATERIALS = 16  # largest number of materials
TOUCHES = 3  # capacity: surfaces near a particle, on average
LANES = 4  # particles of a block on a CPU, numbers in a vector of its registers
LONGEST_LIST = {2: 150, 3: 420}  # capacity: neighbours on average at eta 1.3
DENSEST = 4.0  # density over that at the start, to which they suffice
OF_BLOCK = 1.6  # length of the list of a block of LANES over that of a particle
LONG = 2**24  # entries of lists from which they have memory of their own
CHANNELS = ("compaction", "tension", "shear", "viscosity", "grid", "artificial")

# entries of the `clock`: length of this step and of the last one, rest of the output step, length
# from which a step grows, steps so far [s, 1]
DT, OLD, LEFT, WANT, SUBSTEPS, TIME = range(6)
PARTS = 18  # numbers of the load of a particle on a surface: force and torque, of stress and drags


class Column(NamedTuple):
    """Adjacent numbers of a row of `rigid`, which belongs to a face or a rigid body."""

    name: str
    meaning: str
    unit: str
    width: int


class Columns:
    """First place of each Column in a row as an attribute, its slice as an item."""

    def __init__(self, declared):
        self.count, self._slices = 0, {}
        for column in declared:
            setattr(self, column.name, self.count)
            self._slices[column.name] = slice(self.count, self.count + column.width)
            self.count += column.width

    def __getitem__(self, name):
        return self._slices[name]


RIGID = [
    Column("centre", "position of its centre", "m", 3),
    Column("speed", "velocity half a step back", "m/s", 3),
    Column("turn", "orientation, a quaternion w x y z", "1", 4),
    Column("momentum", "angular momentum half a step back", "kg m^2/s", 3),
    Column("spin", "angular velocity half a step back", "rad/s", 3),
    Column("force", "force of the particles and weight", "N", 3),
    Column("torque", "torque about its centre", "N m", 3),
    Column("impulse", "time integral of the force", "N s", 3),
    Column("work", "work on a face", "J", 1),
    Column("mass", "mass", "kg", 1),
    Column("inertia", "inverse of its inertia in its own frame", "1/(kg m^2)", 9),
    Column("drags", "force and torque by pairs, force and torque on grid noise", "N, N m", 12),
    Column("loss", "work dissipated by pairs and on grid noise", "J", 2),
    Column("radius", "radius of a body", "m", 1),
    Column("half_height", "half its height, 0 of a sphere", "m", 1),
    Column("searched", "centre at the last search", "m", 3),
    Column("layer", "1 of a layer of dust", "1", 1),
    Column("freedom", "0 of forces and torques that mirrors through its centre cancel", "1", 6),
]
COLUMN = Columns(RIGID)


@dataclass(frozen=True)
class ParticleVariable(StateVariable):
    """A variable of a particle (units: SI) and its block in memory.

    Tensors are rows one after another. place: variables of one place are adjacent in memory for
    each particle. answers: it is a result of the first pass, which ghosts get after that.
    """

    place: str
    answers: bool = False


class Layout(NamedTuple):
    """Options that are compiled in.

    Dimension, kernel, ghosts or none, surfaces of rigid faces or none, of rigid bodies or none,
    contact that opens or sticks, viscosity by pairs or none, artificial stress or none, stiffness
    against hourglass modes or none, self-gravity or none, heat of viscosity or none, damage or
    none, one material or several. laws: of the dust. lanes: particles of a block, which share a
    list of neighbours. forces: from outside.
    """

    dimension: int
    kernel: str
    ghosts: bool
    faces: bool
    bodies: bool
    separate: bool
    viscous: bool
    artificial_stress: bool
    hourglass: bool
    self_gravity: bool
    heat: bool
    damage: bool
    materials: bool
    laws: DustLaws
    lanes: int
    forces: ForceModel = ForceModel()

    @property
    def material_numbers(self):
        """Number of the numbers of a material."""
        return len(numbers_class(self.laws).names())

    @property
    def rigid(self):
        """True where there are surfaces, with mirror images behind them."""
        return self.faces or self.bodies

    @property
    def sides(self):
        """True where particles must know to which body their neighbours belong."""
        return self.separate or self.viscous or self.hourglass

    @property
    def artificial(self):
        """True where there are forces of the method that store energy."""
        return self.artificial_stress or self.hourglass


def declare(layout):
    """The variables of a particle, a list of ParticleVariable."""
    vector, tensor = ("f64", layout.dimension), ("f64", layout.dimension**2)
    scalar, count, viscous = ("f64", 0), ("i32", 0), layout.viscous
    rows = [
        ("x", "place", "m", vector, "seen"),
        ("v", "velocity half a step back", "m/s", vector, "seen"),
        ("volume", "volume, 0 of rigid and fixed particles", "m^3", scalar, "seen"),
        ("load", "stress times correction, and grid viscosity", "Pa", tensor, "felt", True),
        ("damping", "viscosity on grid noise", "Pa s", scalar, "felt", True),
        ("impedance", "density times sound", "Pa s/m", scalar, "felt", True),
        ("alpha", "linear viscosity of its pairs", "1", scalar, "felt", viscous),
        ("beta", "quadratic viscosity of its pairs", "1", scalar, "felt", viscous),
        ("density", "density", "kg/m^3", scalar, "felt", viscous),
        ("force", "force of the neighbours and gravity", "N", vector, "own"),
        ("viscous", "viscous part of it", "N", vector, "own"),
        ("grid_force", "part of it by images that acts on grid noise", "N", vector, "own"),
        ("noise_power", "power by pairs that grid noise loses", "W", scalar, "own"),
        ("mass", "mass", "kg", scalar, "own"),
        ("modulus", "bulk modulus of the present path", "Pa", scalar, "own"),
        ("reference", "density at zero pressure on the present path", "kg/m^3", scalar, "own"),
        ("shear_ratio", "shear modulus over bulk modulus", "1", scalar, "own"),
        ("pressure", "pressure", "Pa", scalar, "own"),
        ("deviator", "deviator of the stress", "Pa", tensor, "own"),
        ("work", "work of pressure in and out, of the deviator", "J", ("f64", 3), "own"),
        ("loss", "work of viscosity and of the force on grid noise so far", "J", ("f64", 2), "own"),
        ("x_search", "place at the last search", "m", vector, "own"),
        ("arm", "place in the frame of its rigid body", "m", vector, "own"),
        ("group", "face or rigid body that it moves with, -1 of dust", "1", count, "own"),
        ("role", "dust, rigid, fixed, wall or elastic", "1", count, "own"),
        ("number", "its number in the sample", "1", count, "own"),
    ]
    if layout.bodies:
        # 0 of ghosts, which are always examined
        rows.append(("clearance", "distance from the nearest rigid body", "m", scalar, "seen"))
    if layout.rigid:
        meaning = "stress times correction of the gradient"
        rows.append(("flux", meaning, "Pa", tensor, "image", True))
        rows.append(("drag", "velocity gradient times impedance", "Pa/m", tensor, "image", True))
    if layout.sides:
        rows.append(("side", "dust 0, rigid 1, elastic bodies from 2", "1", count, "kind"))
    if layout.separate:
        rows.append(
            ("gap", "gap at which its contact opened, -1 closed", "m", scalar, "felt", True)
        )
    if layout.artificial_stress:
        rows.append(("tension", "artificial stress of tension", "Pa", tensor, "felt", True))
    if layout.hourglass:
        rows.append(("hourglass", "displacement by hourglass modes", "m", vector, "felt", True))
    if layout.artificial:
        meaning = "force of artificial stress and against hourglass modes"
        rows.append(("pushing", meaning, "N", vector, "own"))
        rows.append(("taken", "work against that force so far", "J", scalar, "own"))
    if layout.heat:
        rows.append(("heating", "heat by viscosity and grid noise per time", "W", scalar, "own"))
        rows.append(("warmed", "heat by viscosity and grid noise so far", "J", scalar, "own"))
    if layout.damage:
        # strain at which the weakest activates, exponent, number, 1/radius [1/m]
        rows.append(("flaws", "flaws of a particle, radius of its volume", "", ("f64", 4), "own"))
        rows.append(("damage", "cube root of its damage", "1", scalar, "own"))
    if layout.forces.powers:
        powers = ("f64", len(layout.forces.powers))
        rows.append(("force_work", "work of forces from outside so far", "J", powers, "own"))
    if layout.forces.charged:
        rows.append(("charge", "charge", "C", scalar, "own"))
    if layout.materials:
        rows.append(("material", "number of its material", "1", count, "own"))
    return [ParticleVariable(*row) for row in rows]


# of the whole simulation: name -> (element, shape); checkpoints have them too
WHOLE = {
    "clock": ("f64", (8,)),
    "rigid": ("f64", (FACES + BODIES, COLUMN.count)),
}


def place(layout, room, entries, ghosts=0):
    """Taichi fields by name.

    room, entries, ghosts: capacities in particles, list entries and ghosts.
    """
    seen = room + max(LEAST_GHOSTS, ghosts) if layout.ghosts else room
    # `near`: of the list of each block what is within reach of the kernel in this step
    long_lists = {"entry": (ti.i32, (entries,)), "near": (ti.i32, (entries,))}
    if layout.rigid:
        # what particles do to the surfaces near them
        long_lists["touch"] = ti.f64, (TOUCHES * room, PARTS)
    apart = place_apart(long_lists) if layout.lanes > 1 and entries > LONG else {}
    variables, fields = declare(layout), {}
    for block in dict.fromkeys(v.place for v in variables):
        together = {v.name: v.field() for v in variables if v.place == block}
        ti.root.dense(ti.i, room if block == "own" else seen).place(*together.values())
        fields |= together
    for name, (dtype, shape) in WHOLE.items():
        fields[name] = ti.field(ELEMENTS[dtype], shape=shape)
    lists = {
        "first": (ti.i32, (room + 1,)),
        "near_counts": (ti.i32, (room,)),  # numbers in `near`
        "chunk_sum": (ti.i32, (scan_capacity(room + 1),)),
        "sync": (ti.i32, (SYNC,)),
        "most": (ti.f64, (MOST_WORKERS * APART,)),
    }
    if layout.rigid:
        # which particles are near which surface
        lists |= {
            "touch_first": (ti.i32, (room + 1,)),
            "touch_row": (ti.i32, (TOUCHES * room,)),
        }
    if layout.self_gravity:
        # places, one axis behind the other, and masses of all that attracts; energies of each
        lists |= {
            "places": (ti.f64, (layout.dimension, room)),
            "weights": (ti.f64, (room,)),
            "potential": (ti.f64, (room,)),
        }
    if layout.forces:
        model = layout.forces
        columns = 3 + len(model.potentials) + len(model.powers)
        lists["forces"] = (ti.f64, (max(1, model.width),))
        lists["force_now"] = (ti.f64, (room, columns))
    if layout.materials:
        lists["materials"] = (ti.f64, (MATERIALS, layout.material_numbers))
    if layout.ghosts:
        lists |= {
            "ghost_first": (ti.i32, (room + 1,)),
            "ghost_shift": (ti.f64, (seen - room, layout.dimension)),
            "ghost_sign": (ti.f64, (seen - room, layout.dimension)),
        }
    if not apart:
        lists |= long_lists
    placed = {name: ti.field(dtype, shape=shape) for name, (dtype, shape) in lists.items()}
    return fields, apart | placed
