"""Types of values in the YAML blocks of several kinds of samples."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BeforeValidator, Discriminator, Field, Tag, TypeAdapter, ValidationError

from dusttaichi.scene.fields import (
    AnyScene,
    Block,
    CoreSchema,
    Count,
    Faults,
    JsonHandler,
    JsonSchema,
    Mark,
    Number,
    build_value_error,
)
from dusttaichi.scene.fields import Seed as Seed
from dusttaichi.scene.quantities import Quantity, Vector, format

Position = Annotated[Vector, Quantity("length", count=3)]
Velocity = Annotated[Vector, Quantity("speed", count=3)]
Spin = Annotated[Vector, Quantity("angular velocity", count=3)]
BoxSize = Annotated[Vector, Quantity("length", gt=0, count=3, example="40 um")]
Radius = Annotated[float, Quantity("length", gt=0, le=1e-3)]
TOO_NARROW = "every side must be at least as long as a grain is wide (2 x material.radius)"


class CylinderSize(Block):
    """Size of an upright cylinder."""

    diameter: Annotated[float, Quantity("length", gt=0, example="13.2 um")] = Field(
        description="diameter of the cylinder"
    )
    height: Annotated[float, Quantity("length", gt=0, example="20 um")] = Field(
        description="height of the cylinder"
    )


def shape_of(size: Any) -> str:
    """Shape of a size: box or cylinder."""
    return "cylinder" if isinstance(size, (dict, CylinderSize)) else "box"


def edges_of(size: Vector | CylinderSize) -> tuple[float, float, float]:
    """Edges (x, y, z) [m] of the upright box around a size."""
    if isinstance(size, CylinderSize):
        return (size.diameter, size.diameter, size.height)
    x, y, z = size
    return x, y, z


Size = Annotated[
    Annotated[BoxSize, Tag("box")] | Annotated[CylinderSize, Tag("cylinder")],
    Discriminator(shape_of),
]

# keys of a shape with a number of grains, or with all grains that fit into a size
CutGrains = Annotated[Count | None, Field(description="number of grains; either this or size")]
CutSize = Annotated[
    Size | None,
    Field(
        description="[Lx, Ly, Lz] of a box, or diameter and height of a cylinder; "
        "either this or grains"
    ),
]


def _material_name(value: Any) -> str | int:
    is_integer = isinstance(value, int) and not isinstance(value, bool)
    if not (is_integer or isinstance(value, str)):
        raise build_value_error(
            "the name of one of the scene's materials is needed, or its number: 0 for material, "
            "from 1 on for materials"
        )
    text: str | int = value
    return text


MaterialName = Annotated[str | int, BeforeValidator(_material_name)]


@dataclass(frozen=True)
class Impact:
    """Impact parameter: a length [m], or a fraction of the sum of the radii."""

    value: float
    fraction: bool = True

    def metres(self, radii: float) -> float:
        """Length [m]; radii: sum of the radii of the partners [m]."""
        return self.value * radii if self.fraction else self.value


_FRACTION = TypeAdapter(Annotated[float, Number(ge=0)])
_LENGTH = TypeAdapter(Annotated[float, Quantity("length", ge=0)])


class _ImpactMark(Mark):
    """Marks an Impact, written as a text with a unit, or as a plain number."""

    requirement = (
        "a length of at least 0 is needed, or a number of at least 0, a fraction of the sum of "
        'the radii, for example "0.5 um" or 0.5'
    )

    def _validate(self, value: Any) -> Impact:
        if isinstance(value, Impact):
            return value
        for form, fraction in ((_FRACTION, True), (_LENGTH, False)):
            try:
                return Impact(form.validate_python(value), fraction)
            except ValidationError:
                continue
        raise build_value_error(self.requirement)

    def _serialize(self, value: Impact) -> Any:
        return value.value if value.fraction else format(value.value, "length")

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: JsonHandler) -> JsonSchema:
        return {"anyOf": [_FRACTION.json_schema(), _LENGTH.json_schema()]}


ImpactParameter = Annotated[Impact, _ImpactMark()]


def exactly_one(block: Block, keys: tuple[str, ...], example: str) -> Faults:
    """A fault unless one of the keys is given."""
    if sum(getattr(block, key) is not None for key in keys) != 1:
        names = f"{', '.join(keys[:-1])} and {keys[-1]}"
        yield "", f"exactly one of {names} is needed, for example {example}"


def unknown_materials(material_names: Sequence[str | int] | None, scene: AnyScene) -> Faults:
    """A fault for the first name or number that no material of the scene has."""
    names = scene.material_names
    for n, name in enumerate(material_names or ()):
        if name not in names and not (isinstance(name, int) and 0 <= name < len(names)):
            text = f"number {n} is {name!r}, which the scene does not have; allowed: "
            yield "materials", text + ", ".join(names)
            return
