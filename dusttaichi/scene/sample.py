"""Where the grains are at the start."""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, ValidationInfo, field_validator, model_validator

from dusttaichi.scene.fields import Block, Count, Number, needed, problems
from dusttaichi.units import Quantity, Vector

Position = Annotated[Vector, Quantity("length", count=3)]
Velocity = Annotated[Vector, Quantity("speed", count=3)]
Spin = Annotated[Vector, Quantity("angular velocity", count=3)]
BoxSize = Annotated[Vector, Quantity("length", gt=0, count=3, example="40 um")]


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
    file: Path | None = Field(
        None,
        description="CSV with the header x,y,z[,vx,vy,vz,wx,wy,wz], NetCDF with the variables of "
        "a snapshot, or the directory or result.nc of another run (its last snapshot); relative "
        "to the YAML file",
    )
    units: Annotated[float, Quantity("length", gt=0, bare_unit=True, example="um")] = Field(
        "m", description="unit of x, y, z in a CSV file; velocities and spins are m/s and rad/s"
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
        for name in ("velocities", "spins"):
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
    seed: Annotated[int, Number(whole=True, ge=0, le=2**32 - 1)] = Field(
        1, description="seed of the random numbers"
    )

    @model_validator(mode="after")
    def _check(self) -> "RbdSample":
        found = []
        if (self.grains is None) == (self.size is None):
            found.append(("", "exactly one of grains and size is needed, for example grains: 1000"))
        if self.size is not None and _size_shape(self.size) != self.shape:
            wanted = {
                "box": 'a list of 3 lengths is needed with shape "box", for example '
                '["40 um", "40 um", "40 um"]',
                "cylinder": 'diameter and height are needed with shape "cylinder", for example '
                "{diameter: 13.2 um, height: 20 um}",
            }
            found.append(("size", wanted[self.shape]))
        if self.size is not None and "aspect" in self.model_fields_set and self.aspect != 1.0:
            found.append(("aspect", "it is allowed only together with grains"))
        if found:
            raise problems(found)
        return self


# One entry a kind: a new kind of sample is a new class here.
Sample = Annotated[ExplicitSample | RbdSample, Field(discriminator="kind")]
