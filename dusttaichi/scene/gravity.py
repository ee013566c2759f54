"""Gravity: the same acceleration everywhere, or one towards a point."""

from typing import Annotated, Any, ClassVar, Literal

from pydantic import model_validator

from dusttaichi.errors import DustError
from dusttaichi.physics.geometry import AXES
from dusttaichi.scene.fields import (
    AnyScene,
    Block,
    CoreSchema,
    Faults,
    Field,
    JsonHandler,
    JsonSchema,
    Number,
    Switch,
    build_value_error,
)
from dusttaichi.scene.quantities import Quantity, Vector, parse

G = 6.6743e-11  # m^3 kg^-1 s^-2, CODATA 2018


class Central(Block):
    """Attraction towards a point: by a mass, or g (d/distance)^exponent at the distance d."""

    centre: Annotated[Vector, Quantity("length", count=3)] = Field(
        ("0 m", "0 m", "0 m"), description="the point that attracts"
    )
    mass: Annotated[float, Quantity("mass", gt=0, example="1e6 kg")] | None = Field(
        None, description="mass at that point, which attracts by Newton's law"
    )
    acceleration: Annotated[float, Quantity("acceleration", gt=0)] | None = Field(
        None, description="acceleration at `distance`, in place of a mass"
    )
    distance: Annotated[float, Quantity("length", gt=0, example="10 um")] | None = Field(
        None, description="with acceleration: distance from the centre at which it has that value"
    )
    exponent: Annotated[float, Number(ge=-3, le=3)] = Field(
        -2.0, description="with acceleration: power of the distance; 1: spring, -2: Newton's law"
    )

    def faults(self) -> Faults:
        if (self.mass is None) == (self.acceleration is None):
            yield "", "exactly one of mass and acceleration is needed"
        elif (self.acceleration is None) != (self.distance is None):
            path = "distance" if self.distance is None else "acceleration"
            yield path, "acceleration and distance are given together"
        elif self.mass is not None and self.exponent != -2.0:
            yield "exponent", "it belongs to acceleration; a mass has -2"

    @property
    def strength(self) -> float:
        """k of g(d) = k d^exponent, SI."""
        if self.mass is not None:
            return G * self.mass
        assert self.acceleration is not None and self.distance is not None  # by `faults`
        return float(self.acceleration / self.distance**self.exponent)


DOWNWARDS = Quantity("acceleration", ge=0, example="9.81 m/s^2")


class GravityField(Block):
    """One of `acceleration` and `central`."""

    acceleration: (
        Annotated[Vector, Quantity("acceleration", count=3, example="-9.81 m/s^2")] | None
    ) = Field(None, description="the same acceleration everywhere")
    central: Central | None = Field(None, description="attraction towards a point")

    def faults(self) -> Faults:
        if (self.acceleration is None) == (self.central is None):
            yield "", "exactly one of acceleration and central is needed"

    @property
    def law(self) -> str:
        """Name of the module of its law."""
        name = "gravity" if self.central is None else "central"
        return f"dusttaichi.physics.forces.{name}"

    @property
    def straight_down(self) -> float:
        """Its size [m/s^2] where it acts along -z, else 0."""
        x, y, z = self.acceleration or (0.0, 0.0, 0.0)
        return -z if z < 0.0 == x == y else 0.0


class Gravity(GravityField):
    """One of `acceleration` and `central`; `gravity: 9.81 m/s^2` is that along -z."""

    requirement: ClassVar[str] = (
        'an acceleration of at least 0 (downwards) is needed, for example "9.81 m/s^2", or a block '
        "such as {acceleration: [0 m/s^2, 0 m/s^2, -9.81 m/s^2]}"
    )

    @model_validator(mode="before")
    @classmethod
    def _downwards(cls, data: Any) -> Any:
        if isinstance(data, (dict, Block)):
            return data
        if isinstance(data, (list, tuple)):
            return {"acceleration": data}
        try:
            size = parse(data, "acceleration")
        except DustError:
            raise build_value_error(cls.requirement) from None
        if size < 0.0:
            raise build_value_error(cls.requirement)
        return {"acceleration": ("0 m/s^2", "0 m/s^2", f"-{str(data).strip().lstrip('+-')}")}

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: JsonHandler) -> JsonSchema:
        block = handler.resolve_ref_schema(handler(schema))
        alternatives = block["properties"]["acceleration"]["anyOf"]
        vector = next(alternative for alternative in alternatives if alternative["type"] == "array")
        vector["minItems"] = 2  # [x, z] in plane strain
        size = DOWNWARDS.__get_pydantic_json_schema__(schema, handler)
        return {"anyOf": [size, vector, block]}


def check(scene: AnyScene) -> Faults:
    """Faults of the gravity of a scene with its boundary."""
    if scene.gravity is not None:
        for path, text in refuse_periodic(scene.gravity, scene.boundary.periodic_axes):
            yield f"gravity.{path}", text


def refuse_periodic(gravity: GravityField, axes: tuple[str, ...]) -> Faults:
    """Faults of gravity in a cell that is periodic along some axes."""
    if not axes:
        return
    if gravity.central is not None:
        text = "a cell is repeated, and a point is not; use kind: open or box"
        yield "central", text
        return
    for n, (axis, component) in enumerate(
        zip(AXES, gravity.acceleration or (0.0,) * 3, strict=True)
    ):
        if component and axis in axes:
            text = (
                f"the cell is periodic along {axis}: what falls across a face would fall for ever; "
                "give 0 there, or leave the axis out of boundary.axes"
            )
            yield f"acceleration.{n}", text


class SelfGravity(Block):
    """Mutual attraction of all particles as spheres, in plane strain as cylinders."""

    softening: Annotated[float | Literal["auto"], Quantity("length", gt=0, word="auto")] = Field(
        "auto",
        description="radius of that sphere, inside of which the attraction falls to 0; auto: the "
        "smoothing length",
    )
    constant: Annotated[float, Number(gt=0)] = Field(
        G, description="constant of gravity in m^3/(kg s^2); a larger one shortens a run"
    )


_SELF = Switch("off, on or a block with softening and constant is needed", on=True)


class ContinuumGravity(Gravity):
    """`acceleration`, `self_gravity` or both; `gravity: 9.81 m/s^2` is along -z."""

    self_gravity: Annotated[SelfGravity | None, _SELF] = Field(
        None, description="mutual attraction of all particles of dust and elastic bodies"
    )

    def faults(self) -> Faults:
        if self.acceleration is None and self.central is None and self.self_gravity is None:
            yield "", "an acceleration or self_gravity is needed"
        if self.acceleration is not None and self.central is not None:
            yield "", "exactly one of acceleration and central is needed"
