"""Surfaces that grains touch beside the walls of the boundary: `surfaces: [{kind: cylinder, ...}]`.

A surface is a block, which declares its keys, and a law: a module (or any object) as
`physics.surfaces` describes it. All surfaces may move: with a `velocity`, and about their `centre`
with a `spin`, which must leave their shape where it is.
"""

from importlib import import_module
from typing import Annotated, Any, Literal

from pydantic import Field

from dusttaichi.physics.forces.force_numbers import Number as Number
from dusttaichi.scene.fields import Faults
from dusttaichi.scene.fields import Number as Plain
from dusttaichi.scene.kinds import AnyOf, KindBlock, Kinds
from dusttaichi.scene.quantities import Quantity, Vector

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

    velocity: Annotated[Vector, Quantity("speed", count=3)] = Field(
        _STILL, description="velocity at which it is driven"
    )
    spin: Annotated[Vector, Quantity("angular velocity", count=3)] = Field(
        _NO_TURN,
        description="angular velocity at which it turns about its centre, its shape staying",
    )
    strength: Annotated[float, Plain(ge=0)] = Field(
        1.0, description="factor on rolling, sliding and twisting"
    )

    @property
    def law(self) -> Any:
        """Law of the surface: an object, or the name of its module."""
        return SURFACES[self.kind].make


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


def find_law(block: Any) -> Any:
    """The law of a block of `surfaces`; its module is imported on first use."""
    return import_module(block.law) if isinstance(block.law, str) else block.law


def any_moves(scene: Any) -> bool:
    """True where a surface of the scene moves or turns, its tube included."""
    moving = any(any((*block.velocity, *block.spin)) for block in scene.surfaces)
    return moving or getattr(scene.boundary, "tube_moves", False)


def find_fastest(scene: Any) -> float:
    """Largest speed at which a surface moves without turning [m/s], its tube included."""
    speeds = [float(sum(a * a for a in block.velocity) ** 0.5) for block in scene.surfaces]
    return max((*speeds, float(getattr(scene.boundary, "tube_speed", 0.0))))


def check(scene: Any) -> Faults:
    """Faults of the surfaces of a scene with its other blocks."""
    for n, surface in enumerate(scene.surfaces):
        if scene.boundary.periodic_axes:
            text = "the cell is repeated, and a surface is not; use boundary.kind: open or box"
            yield f"surfaces.{n}", text
        if any(surface.spin) and "centre" not in find_law(surface).NUMBERS:
            yield f"surfaces.{n}.spin", "it has no centre to turn about"
        for path, text in surface.conflicts(scene):
            yield f"surfaces.{n}.{path}".rstrip("."), text
    if not scene.surfaces:
        return
    if scene.sphere is not None:
        text = "contacts of the sphere with surfaces are not computed; leave one of them out"
        yield "surfaces", text
    if scene.numerics.precision == "f32":
        text = "single precision does not resolve a curved surface; allowed: f64, mixed"
        yield "numerics.precision", text


class Plane(Surface):
    """A plane of any direction."""

    kind: Literal["plane"]
    point: Place = Field(description="a point of the plane")
    normal: Direction = Field(description="its normal, towards the grains")

    def faults(self) -> Faults:
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
        if not any(self.axis):
            yield "axis", "a direction is needed, for example [0, 0, 1]"


register(Plane, f"{_LAWS}.plane")
register(SphericalSurface, f"{_LAWS}.sphere")
register(Cylinder, f"{_LAWS}.cylinder")

AnySurface = Annotated[Surface, AnyOf(SURFACES)]
