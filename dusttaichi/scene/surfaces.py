"""Surfaces that grains touch beside the walls of the boundary: `surfaces: [{kind: cylinder, ...}]`.

A surface is a block, which declares its keys, and a law: a module (or any object) as
`physics.surfaces` describes it. All surfaces may move: with a `velocity`, about their `centre` with
a `spin`, which must leave their shape where it is, and along a `direction` under a load.
"""

from math import hypot, nan
from typing import Annotated, Any, Literal

from pydantic import Field

from dusttaichi.physics.forces.force_numbers import Number as Number
from dusttaichi.physics.geometry import AXES
from dusttaichi.physics.surfaces.surface_motion import SurfaceMotion
from dusttaichi.scene.boundary import BoundaryBlock, bounded_axes, moves_faces
from dusttaichi.scene.fields import Faults
from dusttaichi.scene.fields import Number as Plain
from dusttaichi.scene.forces import find_law
from dusttaichi.scene.kinds import AnyOf, KindBlock, Kinds
from dusttaichi.scene.quantities import Quantity, Vector
from dusttaichi.scene.stage import StageName
from dusttaichi.scene.surface_drive import (
    FORCE,
    GAIN,
    LARGEST,
    PRESSURE,
    SPEED,
    Force,
    Gain,
    Largest,
    Pressed,
    Spin,
    Velocity,
    find_load_faults,
)

SURFACES = Kinds(__name__, "kind of surface")
reads_surfaces = SURFACES.add_reader
_NEEDED = ("NUMBERS", "numbers", "distance", "normal")
_LAWS = "dusttaichi.physics.surfaces"
_STILL: Any = ("0 m/s", "0 m/s", "0 m/s")
_NO_TURN: Any = ("0 rad/s", "0 rad/s", "0 rad/s")
_ORIGIN: Any = ("0 m", "0 m", "0 m")
Component = Annotated[float, Plain()]
Direction = tuple[Component, Component, Component]
Place = Annotated[Vector, Quantity("length", count=3)]


class Surface(KindBlock):
    """The YAML block of a surface; its field `kind` is a Literal with the name of the kind."""

    name: StageName | None = Field(
        None, description="name in results, and by which stages drive it: letters, digits, `_`, `-`"
    )
    velocity: Velocity = Field(
        _STILL, description="velocity at which it is driven; with a force or pressure across that"
    )
    spin: Spin = Field(
        _NO_TURN,
        description="angular velocity at which it turns about its centre, its shape staying",
    )
    strength: Annotated[float, Plain(ge=0)] = Field(
        1.0, description="factor on rolling, sliding and twisting"
    )
    force: Force | None = FORCE
    pressure: Pressed | None = PRESSURE
    direction: Direction | None = Field(
        None, description="along which it presses the grains; of a plane its normal"
    )
    area: Annotated[float, Quantity("area", gt=0)] | None = Field(
        None,
        description="area of a pressure; if not given the cross section of the room, where walls, "
        "a tube or periodic faces bound it across an axis that is its direction",
    )
    largest_speed: Largest | None = LARGEST
    gain: Gain | None = GAIN

    @property
    def law(self) -> Any:
        """Law of the surface: an object, or the name of its module."""
        return SURFACES[self.kind].make

    def has_area(self, boundary: BoundaryBlock) -> bool:
        """True where it has an area, or the room a cross section that it presses along."""
        direction = self.pressing_direction
        if self.area is not None or direction is None:
            return self.area is not None
        axis = max(AXES, key=lambda name: abs(direction[AXES.index(name)]))
        if abs(direction[AXES.index(axis)]) < 1.0 - 1e-9:
            return False
        if boundary.kind == "tube":
            return axis == "z"
        return set(AXES) - {axis} <= set(bounded_axes(boundary))

    def faults(self) -> Faults:
        yield from find_load_faults(self)
        if self.direction is not None and not any(self.direction):
            yield "direction", "a direction is needed, for example [0, 0, 1]"

    @property
    def pressing_direction(self) -> tuple[float, float, float] | None:
        """Unit vector along which it presses; None where there is none."""
        direction = self.direction or getattr(self, "normal", None)
        if direction is None:
            return None
        size = hypot(*direction)
        return direction[0] / size, direction[1] / size, direction[2] / size


def register(block: type[Surface], law: Any) -> None:
    """Add a surface: the YAML may then have its block in `surfaces`.

    A surface that is registered again under its kind replaces the former one. Raises ValueError for
    a built-in kind, or a law that lacks a member; TypeError for a block without a kind.
    """
    if not isinstance(law, str):
        missing = [name for name in _NEEDED if not hasattr(law, name)]
        if missing:
            raise ValueError(f"the law of {block.__name__} lacks {', '.join(missing)}")
    SURFACES.register(block)(law)


def make_motion(block: Surface, boundary: BoundaryBlock) -> SurfaceMotion:
    """The SurfaceMotion of a block of `surfaces` of a scene with that boundary."""
    return SurfaceMotion(
        velocity=block.velocity,
        spin=block.spin,
        force=block.force,
        pressure=block.pressure,
        direction=block.pressing_direction,
        area=block.area if block.has_area(boundary) else nan,
        largest=block.largest_speed or SPEED,
        widens=block.largest_speed is None,
        gain=block.gain,
    )


def list_motions(scene: Any) -> list[list[SurfaceMotion]]:
    """For each stage the SurfaceMotions of all surfaces of a scene."""
    own = [(block.name, make_motion(block, scene.boundary)) for block in scene.surfaces]
    drives = [plan.drive.surfaces for plan in scene.stage_plans]
    return [[motion.driven(drive.get(name)) for name, motion in own] for drive in drives]


def any_moves(scene: Any) -> bool:
    """True where a surface of the scene moves or turns, its tube included."""
    moving = any(
        any((*motion.velocity, *motion.spin)) or motion.load is not None
        for motions in list_motions(scene)
        for motion in motions
    )
    return moving or getattr(scene.boundary, "tube_moves", False)


def find_fastest(scene: Any) -> float:
    """Largest speed at which a surface may move without turning [m/s], its tube included."""
    speeds = [
        hypot(*motion.velocity, motion.largest if motion.load is not None else 0.0)
        for motions in list_motions(scene)
        for motion in motions
    ]
    return max((*speeds, float(getattr(scene.boundary, "tube_speed", 0.0))))


def check_loads(scene: Any) -> Faults:
    """Faults of the loads and spins that the stages of a scene give its surfaces."""
    prefixes = [f"stages.{k}.drive.surfaces." for k in range(len(scene.stages))] or [""]
    faults = {}
    for prefix, plan, motions in zip(prefixes, scene.stage_plans, list_motions(scene), strict=True):
        for n, (block, motion) in enumerate(zip(scene.surfaces, motions, strict=True)):
            drive, path = plan.drive.surfaces.get(block.name), f"surfaces.{n}."
            for key, text in find_motion_faults(scene, block, motion):
                is_of_stage = drive is not None and getattr(drive, key, None) is not None
                faults[(f"{prefix}{block.name}." if is_of_stage else path) + key] = text
    yield from faults.items()


def find_motion_faults(scene: Any, block: Surface, motion: SurfaceMotion) -> Faults:
    """Faults of a SurfaceMotion of a surface of a scene; the paths are its keys."""
    if any(motion.spin) and "centre" not in find_law(block).NUMBERS:
        yield "spin", "it has no centre to turn about"
    if motion.load is None:
        return
    key = "force" if motion.pressure is None else "pressure"
    if motion.direction is None:
        text = "it acts along a direction, and there is none; give direction: [0, 0, -1], as needed"
        yield key, text
        return
    along = sum(a * b for a, b in zip(motion.velocity, motion.direction, strict=True))
    if abs(along) > 1e-9 * hypot(*motion.velocity):
        text = f"along its direction it moves as the {key} needs; allowed: a velocity across that"
        yield "velocity", text
    if motion.pressure is not None and not block.has_area(scene.boundary):
        text = "no area is defined; give the surface one, for example area: 300 um^2, or a force"
        yield key, text


def find_name_faults(scene: Any) -> Faults:
    """Faults of the names of the surfaces of a scene."""
    names = ["tube", *(surface.name for surface in scene.surfaces)]
    for n, name in enumerate(names[1:], start=1):
        if name is not None and name in names[:n]:
            yield f"surfaces.{n - 1}.name", "it is used already; every surface needs its own"


def check(scene: Any) -> Faults:
    """Faults of the surfaces of a scene with its other blocks."""
    yield from find_name_faults(scene)
    yield from check_loads(scene)
    for n, surface in enumerate(scene.surfaces):
        if moves_faces(scene):
            text = "the faces of a cell with surfaces must rest; wall_speed may be used"
            yield f"surfaces.{n}", text
        for path, text in surface.conflicts(scene):
            yield f"surfaces.{n}.{path}".rstrip("."), text
    if not scene.surfaces:
        return
    if scene.sphere is not None:
        text = "contacts of the sphere with surfaces are not computed; leave one of them out"
        yield "surfaces", text


class Plane(Surface):
    """A plane of any direction."""

    kind: Literal["plane"]
    point: Place = Field(description="a point of the plane")
    normal: Direction = Field(description="its normal, towards the grains")

    def faults(self) -> Faults:
        yield from super().faults()
        if not any(self.normal):
            yield "normal", "a direction is needed, for example [0, 0, 1]"


class _Round(Surface):
    radius: Annotated[float, Quantity("length", gt=0, le=1, example="20 um")] = Field(
        description="radius"
    )
    centre: Place = Field(_ORIGIN, description="its centre, or a point of its axis")
    grains: Literal["inside", "outside"] = Field(
        "inside", description="the side of the surface that the grains are on"
    )

    @property
    def side(self) -> float:
        """1 where the grains are inside, -1 outside."""
        return 1.0 if self.grains == "inside" else -1.0


class SphericalSurface(_Round):
    """A spherical shell around the grains, or a solid sphere among them."""

    kind: Literal["sphere"]


class Cylinder(_Round):
    """A tube around the grains, or a rod among them, of any direction and without ends."""

    kind: Literal["cylinder"]
    axis: Direction = Field((0.0, 0.0, 1.0), description="direction of its axis")

    def faults(self) -> Faults:
        yield from super().faults()
        if not any(self.axis):
            yield "axis", "a direction is needed, for example [0, 0, 1]"


register(Plane, f"{_LAWS}.plane")
register(SphericalSurface, f"{_LAWS}.sphere")
register(Cylinder, f"{_LAWS}.cylinder")

AnySurface = Annotated[Surface, AnyOf(SURFACES)]
