"""Gravity: the same acceleration everywhere, or one towards a point."""

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from dusttaichi.errors import DustError
from dusttaichi.names import AXES
from dusttaichi.scene.fields import Block, Number, Switch, needed, problems
from dusttaichi.scene.quantities import Quantity, Vector, parse

G = 6.6743e-11  # m^3 kg^-1 s^-2, CODATA 2018
Found = list[tuple[str, str]]


class Central(Block):
    """Attraction towards a point: of a mass, or g (d/distance)^exponent at the distance d."""

    centre: Annotated[Vector, Quantity("length", count=3)] = Field(
        ("0 m", "0 m", "0 m"), description="the point that attracts"
    )
    mass: Annotated[float, Quantity("mass", gt=0, example="1e6 kg")] | None = Field(
        None, description="mass at that point, which attracts as Newton's law says"
    )
    acceleration: Annotated[float, Quantity("acceleration", gt=0)] | None = Field(
        None, description="acceleration at `distance`, in place of a mass"
    )
    distance: Annotated[float, Quantity("length", gt=0, example="10 um")] | None = Field(
        None, description="with acceleration: distance from the centre at which it has that value"
    )
    exponent: Annotated[float, Number(ge=-3, le=3)] = Field(
        -2.0, description="with acceleration: of the distance; 1 is a spring, -2 Newton's law"
    )

    @model_validator(mode="after")
    def _check(self) -> "Central":
        if (self.mass is None) == (self.acceleration is None):
            raise problems([("", "exactly one of mass and acceleration is needed")])
        if (self.acceleration is None) != (self.distance is None):
            path = "distance" if self.distance is None else "acceleration"
            raise problems([(path, "acceleration and distance are given together")])
        if self.mass is not None and self.exponent != -2.0:
            raise problems([("exponent", "it belongs to acceleration; a mass has -2")])
        return self

    @property
    def strength(self) -> float:
        """k of g(d) = k d^exponent, SI."""
        if self.mass is not None:
            return G * self.mass
        return self.acceleration / self.distance**self.exponent


DOWNWARDS = Quantity("acceleration", ge=0, example="9.81 m/s^2")


class Gravity(Block):
    """One of `acceleration` and `central`; `gravity: 9.81 m/s^2` is that along -z."""

    needed: ClassVar[str] = (
        'an acceleration of at least 0 (downwards) is needed, for example "9.81 m/s^2", or a block '
        "such as {acceleration: [0 m/s^2, 0 m/s^2, -9.81 m/s^2]}"
    )

    acceleration: (
        Annotated[Vector, Quantity("acceleration", count=3, example="-9.81 m/s^2")] | None
    ) = Field(None, description="the same acceleration everywhere")
    central: Central | None = Field(None, description="attraction towards a point")

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
            raise needed(cls.needed) from None
        if size < 0.0:
            raise needed(cls.needed)
        return {"acceleration": ("0 m/s^2", "0 m/s^2", f"-{str(data).strip().lstrip('+-')}")}

    @model_validator(mode="after")
    def _check(self) -> "Gravity":
        if (self.acceleration is None) == (self.central is None):
            raise problems([("", "exactly one of acceleration and central is needed")])
        return self

    @property
    def kind(self) -> str:
        return "constant" if self.central is None else "central"

    @property
    def straight_down(self) -> float:
        """Its size [m/s^2] where it acts along -z, else 0."""
        x, y, z = self.acceleration or (0.0, 0.0, 0.0)
        return -z if z < 0.0 == x == y else 0.0

    @classmethod
    def __get_pydantic_json_schema__(cls, schema, handler):
        block = handler.resolve_ref_schema(handler(schema))
        either = block["properties"]["acceleration"]["anyOf"]
        vector = next(one for one in either if one["type"] == "array")
        vector["minItems"] = 2  # [x, z] in plane strain
        size = DOWNWARDS.__get_pydantic_json_schema__(schema, handler)
        return {"anyOf": [size, vector, block]}


def check(scene) -> Found:
    """Problems of the gravity of a scene with its boundary, as (dotted path, text)."""
    axes = scene.boundary.periodic_axes
    if scene.gravity is None or not axes:
        return []
    if scene.gravity.central is not None:
        return [("gravity.central", "a cell repeats, and a point does not; use kind: open or box")]
    if scene.gravity.acceleration is None:
        return []
    return [
        (
            f"gravity.acceleration.{n}",
            f"the cell repeats along {axis}: what falls across a face would fall for ever; "
            "give 0 there, or leave the axis out of boundary.axes",
        )
        for n, (axis, g) in enumerate(zip(AXES, scene.gravity.acceleration, strict=True))
        if g and axis in axes
    ]


class SelfGravity(Block):
    """Every particle attracts every other one as a ball, in plane strain as a cylinder."""

    softening: Annotated[float | Literal["auto"], Quantity("length", gt=0, word="auto")] = Field(
        "auto",
        description="radius of that ball, inside of which the attraction falls to 0; auto: the "
        "smoothing length",
    )
    constant: Annotated[float, Number(gt=0)] = Field(
        G, description="constant of gravity in m^3/(kg s^2); a larger one shortens a run"
    )


_SELF = Switch("off, on or a block with softening and constant is needed", on=True)


class ContinuumGravity(Gravity):
    """`acceleration`, `self_gravity` or both; `gravity: 9.81 m/s^2` is along -z."""

    self_gravity: Annotated[SelfGravity | None, _SELF] = Field(
        None, description="attraction of dust and elastic bodies by themselves and each other"
    )

    @model_validator(mode="after")
    def _check(self) -> "ContinuumGravity":
        if self.acceleration is None and self.central is None and self.self_gravity is None:
            raise problems([("", "an acceleration or self_gravity is needed")])
        if self.acceleration is not None and self.central is not None:
            raise problems([("", "exactly one of acceleration and central is needed")])
        return self
