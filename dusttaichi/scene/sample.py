"""Where the grains are at the start."""

from dataclasses import dataclass
from math import pi
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    Discriminator,
    Field,
    Tag,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic_core import PydanticCustomError, core_schema

from dusttaichi.scene.fields import Block, Count, Number, needed, problems
from dusttaichi.scene.quantities import Quantity, Vector, format

Position = Annotated[Vector, Quantity("length", count=3)]
Velocity = Annotated[Vector, Quantity("speed", count=3)]
Spin = Annotated[Vector, Quantity("angular velocity", count=3)]
BoxSize = Annotated[Vector, Quantity("length", gt=0, count=3, example="40 um")]
Radius = Annotated[float, Quantity("length", gt=0, le=1e-3)]
DEFAULT = "default"  # name of the scene's `material` beside those of `materials`


def _material_name(value: Any) -> str | int:
    whole = isinstance(value, int) and not isinstance(value, bool)
    if not (whole or isinstance(value, str)):
        raise needed(
            "the name of one of the scene's materials is needed, or its number: 0 for material, "
            "from 1 on for materials"
        )
    return value


MaterialName = Annotated[str | int, BeforeValidator(_material_name)]


class ExplicitSample(Block):
    """Grains given one by one, in the YAML file (`positions`) or in another file (`file`)."""

    kind: Literal["explicit"]
    positions: tuple[Position, ...] | None = Field(
        None, description="centre of every grain, [x, y, z]"
    )
    velocities: tuple[Velocity, ...] | None = Field(
        None, description="velocity of every grain, default at rest; only with positions"
    )
    spins: tuple[Spin, ...] | None = Field(
        None, description="angular velocity of every grain, default none; only with positions"
    )
    radii: tuple[Radius, ...] | None = Field(
        None, description="radius of every grain, default that of its material; only with positions"
    )
    materials: tuple[MaterialName, ...] | None = Field(
        None,
        description="material of every grain, a name from the scene's materials, or default; "
        "only with positions",
    )
    file: Path | None = Field(
        None,
        description="CSV with the header x,y,z[,vx,vy,vz,wx,wy,wz][,radius,material], NetCDF with "
        "the variables of "
        "a snapshot, or the directory or result.nc of another run (its last snapshot); relative "
        "to the YAML file",
    )
    units: Annotated[float, Quantity("length", gt=0, bare_unit=True, example="um")] = Field(
        "m",
        description="unit of x, y, z, radius in a CSV file; velocities and spins are m/s and rad/s",
    )

    @field_validator("file", mode="after")
    @classmethod
    def _find(cls, value: Path | None, info: ValidationInfo) -> Path | None:
        if value is None:
            return None
        context = info.context or {}
        if context.get("folder"):
            value = Path(context["folder"]) / value
        if context.get("check_files") and not value.exists():
            raise needed(f"there is no such file ({value})")
        return value

    @model_validator(mode="after")
    def _check(self) -> "ExplicitSample":
        found = []
        if (self.positions is None) == (self.file is None):
            found.append(("", "exactly one of positions and file is needed"))
        if self.positions is not None and not self.positions:
            found.append(("positions", "at least one grain is needed"))
        for name in ("velocities", "spins", "radii", "materials"):
            values = getattr(self, name)
            if values is None:
                continue
            if self.positions is None:
                found.append((name, "it is allowed only together with positions"))
            elif len(values) != len(self.positions):
                found.append(
                    (
                        name,
                        f"as many as positions are needed, {len(self.positions)} and not "
                        f"{len(values)}",
                    )
                )
        if self.file is None and "units" in self.model_fields_set and self.units != 1.0:
            found.append(("units", "it is allowed only together with file"))
        if found:
            raise problems(found)
        return self


class CylinderSize(Block):
    """Size of an upright cylinder."""

    diameter: Annotated[float, Quantity("length", gt=0, example="13.2 um")] = Field(
        description="diameter of the cylinder"
    )
    height: Annotated[float, Quantity("length", gt=0, example="20 um")] = Field(
        description="height of the cylinder"
    )


def _size_shape(value: Any) -> str:
    return "cylinder" if isinstance(value, (dict, CylinderSize)) else "box"


Size = Annotated[
    Annotated[BoxSize, Tag("box")] | Annotated[CylinderSize, Tag("cylinder")],
    Discriminator(_size_shape),
]


Seed = Annotated[int, Number(whole=True, ge=0, le=2**32 - 1)]


def _exactly_one(block: Block, keys: tuple[str, ...], example: str) -> list[tuple[str, str]]:
    """A problem unless one of the keys is given."""
    if sum(getattr(block, key) is not None for key in keys) == 1:
        return []
    names = f"{', '.join(keys[:-1])} and {keys[-1]}"
    return [("", f"exactly one of {names} is needed, for example {example}")]


def _check_cut(block: Block) -> list[tuple[str, str]]:
    """Problems of grains, size, shape and aspect of a cut."""
    found = _exactly_one(block, ("grains", "size"), "grains: 1000")
    if block.size is not None and _size_shape(block.size) != block.shape:
        wanted = {
            "box": 'a list of 3 lengths is needed with shape "box", for example '
            '["40 um", "40 um", "40 um"]',
            "cylinder": 'diameter and height are needed with shape "cylinder", for example '
            "{diameter: 13.2 um, height: 20 um}",
            "aggregate": 'it is not allowed with shape "aggregate", of which nothing is cut; '
            "set grains, or shape: box or cylinder",
        }
        found.append(("size", wanted[block.shape]))
    if block.size is not None and block.aspect != 1.0:
        found.append(("aspect", "it is allowed only together with grains"))
    return found


class RbdSample(Block):
    """A cake grown by random ballistic deposition (S12 section 3.1)."""

    kind: Literal["rbd"]
    shape: Literal["box", "cylinder"] = Field("box", description="shape that is cut from the cake")
    grains: Count | None = Field(None, description="number of grains; either this or size")
    size: Size | None = Field(
        None,
        description="[Lx, Ly, Lz] of a box, or diameter and height of a cylinder; "
        "either this or grains",
    )
    aspect: Annotated[float, Number(gt=0)] = Field(
        1.0, description="height over width, with grains"
    )
    seed: Seed = Field(1, description="seed of the random numbers")

    @model_validator(mode="after")
    def _check(self) -> "RbdSample":
        found = _check_cut(self)
        if found:
            raise problems(found)
        return self


class PcaSample(Block):
    """An aggregate grown grain by grain from all sides (PD08 section 3.1.1), or a cut from one."""

    kind: Literal["pca"]
    shape: Literal["aggregate", "box", "cylinder"] = Field(
        "aggregate",
        description="the aggregate as it grew, or the shape that is cut from a larger one; "
        "with size that of size",
    )
    grains: Count | None = Field(None, description="number of grains; either this or size")
    size: Size | None = Field(
        None,
        description="[Lx, Ly, Lz] of a box, or diameter and height of a cylinder; "
        "either this or grains",
    )
    aspect: Annotated[float, Number(gt=0)] = Field(
        1.0, description="height over width of a cut, with grains"
    )
    seed: Seed = Field(1, description="seed of the random numbers")

    @model_validator(mode="before")
    @classmethod
    def _shape_of_size(cls, data: Any) -> Any:
        if isinstance(data, dict) and data.get("size") is not None:
            return {"shape": _size_shape(data["size"]), **data}
        return data

    @model_validator(mode="after")
    def _check(self) -> "PcaSample":
        found = _check_cut(self)
        if self.shape == "aggregate" and self.size is None and self.aspect != 1.0:
            found.append(("aspect", "it is allowed only with shape box or cylinder"))
        if found:
            raise problems(found)
        return self


class BccaSample(Block):
    """An aggregate grown by ballistic collisions of equal clusters (BCCA)."""

    kind: Literal["bcca"]
    grains: Count = Field(description="number of grains, a power of two")
    seed: Seed = Field(1, description="seed of the random numbers")

    @field_validator("grains", mode="after")
    @classmethod
    def _power_of_two(cls, value: int) -> int:
        if value & (value - 1):
            below = 1 << (value.bit_length() - 1)
            raise needed(f"a power of two is needed, for example {below} or {2 * below}")
        return value


class LatticeSample(Block):
    """A crystal of grains in equilibrium contact that can be repeated without a seam."""

    kind: Literal["lattice"]
    structure: Literal["sc", "bcc", "fcc", "ccp"] = Field(
        description="simple cubic, body-centred cubic, face-centred cubic, or that with its "
        "close-packed layers across z"
    )
    cells: tuple[Count, Count, Count] | None = Field(
        None, description="number of cells along x, y, z; this, grains or size"
    )
    grains: Count | None = Field(
        None, description="number of grains, rounded up to whole cells in about a cube"
    )
    size: BoxSize | None = Field(
        None, description="[Lx, Ly, Lz] that is filled with as many whole cells as it holds"
    )

    @field_validator("cells", mode="before")
    @classmethod
    def _three(cls, value: Any) -> Any:
        if value is not None and not (isinstance(value, (list, tuple)) and len(value) == 3):
            raise needed("a list of 3 whole numbers of at least 1 is needed, such as [10, 10, 10]")
        return value

    @model_validator(mode="after")
    def _check(self) -> "LatticeSample":
        found = _exactly_one(self, ("cells", "grains", "size"), "cells: [10, 10, 10]")
        if found:
            raise problems(found)
        return self


class RandomPackingSample(Block):
    """Grains packed at random in a periodic cell, up to just below random close packing."""

    kind: Literal["random_packing"]
    grains: Count | None = Field(
        None, description="number of grains, in a cube; either this or size"
    )
    size: BoxSize | None = Field(
        None, description="[Lx, Ly, Lz] of the cell; either this or grains"
    )
    filling_factor: Annotated[float, Number(gt=0, le=0.62)] = Field(
        0.6, description="grain volume over the volume of the cell"
    )
    seed: Seed = Field(1, description="seed of the random numbers")

    @model_validator(mode="after")
    def _check(self) -> "RandomPackingSample":
        found = _exactly_one(self, ("grains", "size"), "grains: 1000")
        if found:
            raise problems(found)
        return self


class ChainSample(Block):
    """A straight chain of grains in equilibrium contact."""

    kind: Literal["chain"]
    grains: Count = Field(description="number of grains")
    axis: Literal["x", "y", "z"] = Field("z", description="direction of the chain")


@dataclass(frozen=True)
class Impact:
    """An impact parameter: a length [m], or a fraction of the sum of the radii."""

    value: float
    fraction: bool = True

    def metres(self, radii: float) -> float:
        """radii: sum of the radii of the two that meet [m]."""
        return self.value * radii if self.fraction else self.value


class _ImpactMark:
    """Reads an Impact: a text with a unit, or a plain number."""

    length = Quantity("length", ge=0)
    number = Number(ge=0)
    needed = (
        "a length of at least 0 is needed, or a number of at least 0, a fraction of the sum of "
        'the radii, for example "0.5 um" or 0.5'
    )

    def _validate(self, value: Any) -> Impact:
        if isinstance(value, Impact):
            return value
        for mark, fraction in ((self.number, True), (self.length, False)):
            try:
                return Impact(mark._validate(value), fraction)
            except PydanticCustomError:
                continue
        raise needed(self.needed)

    def _serialize(self, value: Impact) -> Any:
        return value.value if value.fraction else format(value.value, "length")

    def __get_pydantic_core_schema__(self, source, handler):
        return core_schema.no_info_plain_validator_function(
            self._validate,
            serialization=core_schema.plain_serializer_function_ser_schema(
                self._serialize, when_used="json"
            ),
        )

    def __get_pydantic_json_schema__(self, schema, handler):
        marks = (self.number, self.length)
        return {"anyOf": [mark.__get_pydantic_json_schema__(schema, handler) for mark in marks]}


ImpactParameter = Annotated[Impact, _ImpactMark()]


class PairSample(Block):
    """Two grains; grain 1 flies along -x and grain 0 along +x, each with half of the speed."""

    kind: Literal["pair"]
    distance: Annotated[float, Quantity("length", gt=0, example="1.3 um")] | None = Field(
        None,
        description="between the centres at the start; without it and gap: equilibrium contact",
    )
    gap: Annotated[float, Quantity("length", example="10 nm")] | None = Field(
        None, description="between the surfaces at the start, below 0 for an overlap"
    )
    speed: Annotated[float, Quantity("speed", ge=0)] = Field(
        "0 m/s", description="relative speed at the start"
    )
    impact_parameter: ImpactParameter = Field(
        0.0, description="along y: a length, or a fraction of the sum of the radii"
    )
    angle: Annotated[float, Quantity("angle", ge=0, le=pi / 2)] | None = Field(
        None,
        description="between the line of centres and the flight at the start, in place of "
        "impact_parameter; 0 is head-on",
    )
    spins: tuple[Spin, ...] | None = Field(
        None, description="angular velocities of the two, default none"
    )
    radii: tuple[Radius, ...] | None = Field(
        None, description="radii of the two, default that of their material"
    )
    materials: tuple[MaterialName, ...] | None = Field(
        None, description="materials of the two, names from the scene's materials, or default"
    )

    @model_validator(mode="after")
    def _check(self) -> "PairSample":
        found = []
        if self.distance is not None and self.gap is not None:
            found.append(("gap", "it is not allowed together with distance; keep one of them"))
        if self.angle is not None and self.impact_parameter.value != 0:
            found.append(("angle", "it is not allowed together with impact_parameter"))
        for name in ("spins", "radii", "materials"):
            values = getattr(self, name)
            if values is not None and len(values) != 2:
                found.append((name, f"2 are needed, one a grain, and not {len(values)}"))
        if found:
            raise problems(found)
        return self


# What can be a body of a collision. One entry a kind: a new kind of sample is a new class here.
Body = Annotated[
    BccaSample
    | ChainSample
    | ExplicitSample
    | LatticeSample
    | PairSample
    | PcaSample
    | RandomPackingSample
    | RbdSample,
    Field(discriminator="kind"),
]


class CollisionSample(Block):
    """Two bodies that fly at each other; the projectile along -x, the centre of mass at rest."""

    kind: Literal["collision"]
    target: Body = Field(description="one body: a sample of another kind")
    projectile: Body = Field(description="the other body, which comes from the side of +x")
    speed: Annotated[float, Quantity("speed", ge=0, example="1 m/s")] = Field(
        description="relative speed at the start"
    )
    impact_parameter: ImpactParameter = Field(
        0.0, description="along y: a length, or a fraction of the sum of the outer radii"
    )
    orientation: Literal["random", "as given"] = Field(
        "random", description="whether both bodies are turned at random"
    )
    gap: Annotated[float, Quantity("length", ge=0, example="0.6 um")] | None = Field(
        None, description="length of flight before the first touch, default a grain radius"
    )
    seed: Seed = Field(1, description="seed of the random orientations")


Sample = Annotated[
    BccaSample
    | ChainSample
    | CollisionSample
    | ExplicitSample
    | LatticeSample
    | PairSample
    | PcaSample
    | RandomPackingSample
    | RbdSample,
    Field(discriminator="kind"),
]
