"""A scene of the method `continuum`: what the dust is made of, which bodies, and where."""

from typing import Any, ClassVar, Literal

from pydantic import Field, ValidationInfo, field_validator, model_validator

from dusttaichi.samples.continuum import AnyParticles, reads_particles
from dusttaichi.scene.continuum_boundary import ContinuumBoundary, FacesBoundary, OpenBoundary
from dusttaichi.scene.continuum_material import ContinuumMaterial
from dusttaichi.scene.continuum_numerics import ContinuumNumerics
from dusttaichi.scene.gravity import ContinuumGravity
from dusttaichi.scene.gravity import check as check_gravity
from dusttaichi.scene.material import DEFAULT
from dusttaichi.scene.scene import Scene, check_names


@reads_particles
class ContinuumScene(Scene):
    """A run of dust as a continuum (Güttler et al. 2009); all quantities are SI floats."""

    SERIES_STEPS: ClassVar[int] = 5  # which the method divides into eight and more

    order: ClassVar[tuple[str, ...]] = (
        "name",
        "extensions",
        "method",
        "dimension",
        "material",
        "materials",
        "sample",
        "gravity",
        "boundary",
        "stop",
        "stages",
        "numerics",
        "output",
        "replicas",
    )

    method: Literal["continuum"] = Field(description="what computes the run")
    dimension: Literal[2, 3] = Field(
        2, description="2: plane strain in x and z, masses and energies per metre of depth; or 3"
    )
    material: ContinuumMaterial = Field(
        description="what the dust is made of: a name, a block with `base` and the numbers that "
        "differ, or a block with all numbers"
    )
    materials: dict[str, ContinuumMaterial] = Field(
        {},
        description="further materials that bodies of dust may be of, by name, each written like "
        "`material`",
    )
    sample: AnyParticles = Field(description="what bodies there are at the start")
    gravity: ContinuumGravity | None = Field(
        None,
        description="acceleration of everything that is free: downwards, or a list, "
        "[x, z] with dimension: 2; or {self_gravity: on}",
    )
    boundary: ContinuumBoundary = Field(
        OpenBoundary(kind="open"), description="what surrounds the dust"
    )
    numerics: ContinuumNumerics = Field(description="particles, kernel, viscosity, time step")

    @model_validator(mode="before")
    @classmethod
    def _without_dust(cls, data: Any) -> Any:
        """Where no body is of dust, the material is one that nothing is made of."""
        if isinstance(data, dict) and "material" not in data and not _has_dust(data.get("sample")):
            return data | {"material": "dust_g09"}
        return data

    @classmethod
    def __get_pydantic_json_schema__(cls, schema, handler):
        written = handler(schema)
        block = handler.resolve_ref_schema(written)
        block["required"] = [key for key in block["required"] if key != "material"]
        return written

    @field_validator("materials", mode="after")
    @classmethod
    def _names(cls, value: dict[str, ContinuumMaterial]) -> dict[str, ContinuumMaterial]:
        return check_names(value)

    @property
    def all_materials(self) -> tuple[ContinuumMaterial, ...]:
        """Materials of the dust, by number: the material, and the others."""
        return (self.material, *self.materials.values())

    @property
    def material_names(self) -> tuple[str, ...]:
        """Their names, in the same order."""
        return (DEFAULT, *self.materials)

    @field_validator("gravity", mode="before")
    @classmethod
    def _in_the_plane(cls, value: Any, info: ValidationInfo) -> Any:
        """[x, z] of plane strain in space."""
        block = value if isinstance(value, dict) else {"acceleration": value}
        along = block.get("acceleration")
        if info.data.get("dimension") != 2 or not isinstance(along, list) or len(along) != 2:
            return value
        return block | {"acceleration": [along[0], "0 m/s^2", along[1]]}

    def conflicts(self) -> list[tuple[str, str]]:
        blocks = {"sample": self.sample.conflicts(self)}
        if isinstance(self.boundary, FacesBoundary):
            blocks["boundary"] = [*self.boundary.conflicts(self.dimension), *self._mirrors()]
        found = [
            (f"{block}.{key}".rstrip("."), text)
            for block, problems in blocks.items()
            for key, text in problems
        ]
        found += [*check_gravity(self), *self._plane_gravity(), *self._heat()]
        return [*super().conflicts(), *found]

    def _heat(self) -> list[tuple[str, str]]:
        """All of the dust has a temperature, or none."""
        warm = [material.heat_capacity is not None for material in self.all_materials]
        if any(warm) == all(warm):
            return []
        without = self.material_names[warm.index(False)]
        path = "material" if without == DEFAULT else f"materials.{without}"
        return [(f"{path}.heat_capacity", "another material has one; give it to all, or to none")]

    def _plane_gravity(self) -> list[tuple[str, str]]:
        """Problems of a gravity that a continuum, or its plane, does not have."""
        if self.gravity is None:
            return []
        if self.gravity.central is not None:
            return [("gravity.central", "allowed with method: grains only; give an acceleration")]
        found = []
        if self.dimension == 2 and (self.gravity.acceleration or (0.0, 0.0))[1]:
            text = "there is no y in plane strain; give 0 there"
            found.append(("gravity.acceleration.1", text))
        return [*found, *self._self_gravity()]

    def _self_gravity(self) -> list[tuple[str, str]]:
        """Problems of self-gravity: images (infinitely many) and rigid bodies attract nothing."""
        if self.gravity.self_gravity is None:
            return []
        found = []
        if self.boundary.periodic_axes or getattr(self.boundary, "mirrors", ()):
            text = "images beyond periodic faces and mirrors do not attract; leave one of both out"
            found.append(("gravity.self_gravity", text))
        if self.sample.has_rigid:
            text = "rigid bodies do not attract; take elastic ones, or leave it out"
            found.append(("gravity.self_gravity", text))
        return found

    def _mirrors(self) -> list[tuple[str, str]]:
        """Images beyond a mirror stay where they are."""
        if "top" not in self.boundary.mirrors:
            return []
        if not any(plan.drive.wall_speed for plan in self.stage_plans):
            return []
        return [("top", "a mirror does not move; allowed with wall_speed: rigid, or a layer")]


def _has_dust(sample: Any) -> bool:
    """Whether plain data of a sample has a body of dust, or is none."""
    if not isinstance(sample, dict):
        return True
    inner = [sample[key] for key in ("target", "projectile") if key in sample]
    inner += sample.get("bodies") or []
    if inner:
        return any(map(_has_dust, inner))
    return sample.get("kind", "rigid") not in ("elastic", "rigid")
