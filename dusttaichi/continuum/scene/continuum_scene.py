"""A scene of the method `continuum`: materials and bodies of dust."""

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from pydantic import Field, ValidationInfo, field_validator, model_validator

from dusttaichi.continuum.physics import dust_laws
from dusttaichi.continuum.physics.material_numbers import CommonNumbers
from dusttaichi.continuum.samples import AnyParticles, reads_particles
from dusttaichi.continuum.scene.boundary import ContinuumBoundary, FacesBoundary, OpenBoundary
from dusttaichi.continuum.scene.material import ContinuumMaterial
from dusttaichi.continuum.scene.numerics import ContinuumNumerics
from dusttaichi.scene.charge import Charge
from dusttaichi.scene.fields import Faults
from dusttaichi.scene.forces import AnyForce, reads_forces
from dusttaichi.scene.forces import check as check_forces
from dusttaichi.scene.gravity import ContinuumGravity
from dusttaichi.scene.gravity import check as check_gravity
from dusttaichi.scene.material import DEFAULT
from dusttaichi.scene.scene import MaterialsScene


@reads_forces
@reads_particles
class ContinuumScene(MaterialsScene):
    """A run of dust as a continuum (Güttler et al. 2009); all quantities are SI floats."""

    SERIES_STEPS: ClassVar[int] = 5  # each of which the method divides into eight or more
    IGNORED: ClassVar[Mapping[str, str]] = {
        "drive.sphere_speed": "it is for the sphere of method: grains; rigid and elastic bodies of "
        "a continuum keep the speed of their block in `sample`",
        "drive.push": "pushes act on grains; give a body of `sample` a speed, or use gravity or "
        "`forces`",
        "output.contacts": "a continuum has no contacts between grains; leave it out",
        "output.forces": "a continuum has no contacts between grains; leave it out",
    }

    order: ClassVar[str] = (
        "name extensions method dimension material materials sample charge gravity forces boundary "
        "stop stages numerics output replicas"
    )

    method: Literal["continuum"] = Field(description="method of simulation")
    dimension: Literal[2, 3] = Field(
        2, description="2: plane strain in x and z, masses and energies per metre of depth; or 3"
    )
    material: ContinuumMaterial = Field(
        description="material of the dust: a name, a block with `base` and the numbers that "
        "differ, or a block with all numbers"
    )
    materials: dict[str, ContinuumMaterial] = Field(
        {}, description="further materials of bodies of dust, by name, each written like `material`"
    )
    sample: AnyParticles = Field(description="bodies at the start")
    charge: Charge | None = Field(None, description="charges of the particles: `per_mass`")
    forces: tuple[AnyForce, ...] = Field(
        (), description="forces from outside on dust and elastic bodies"
    )
    gravity: ContinuumGravity | None = Field(
        None,
        description="acceleration of all free bodies: downwards, or a list, "
        "[x, z] with dimension: 2; or {self_gravity: on}",
    )
    boundary: ContinuumBoundary = Field(
        OpenBoundary(kind="open"), description="walls and periodic faces"
    )
    numerics: ContinuumNumerics = Field(description="particles, kernel, viscosity, time step")

    @property
    def resists_hourglass(self) -> bool:
        """True where there are elastic bodies that resist hourglass modes."""
        return self.numerics.hourglass > 0.0 and self.sample.has_elastic

    @model_validator(mode="before")
    @classmethod
    def _without_dust(cls, data: Any) -> Any:
        """A scene without dust needs no material; it gets one that nothing is made of."""
        if isinstance(data, dict) and "material" not in data and not _has_dust(data.get("sample")):
            return data | {"material": "dust_g09"}
        return data

    @classmethod
    def __get_pydantic_json_schema__(cls, schema, handler):
        written = handler(schema)
        block = handler.resolve_ref_schema(written)
        block["required"] = [key for key in block["required"] if key != "material"]
        return written

    @field_validator("gravity", mode="before")
    @classmethod
    def _in_the_plane(cls, value: Any, info: ValidationInfo) -> Any:
        """Gravity [x, z] of plane strain as a vector in space."""
        block = value if isinstance(value, dict) else {"acceleration": value}
        along = block.get("acceleration")
        if info.data.get("dimension") != 2 or not isinstance(along, list) or len(along) != 2:
            return value
        return block | {"acceleration": [along[0], "0 m/s^2", along[1]]}

    def faults(self) -> Faults:
        blocks = {"sample": self.sample.conflicts(self)}
        if isinstance(self.boundary, FacesBoundary):
            blocks["boundary"] = [*self.boundary.conflicts(self.dimension), *self._mirrors()]
        conflicts = [
            (f"{block}.{key}".rstrip("."), text)
            for block, faults in blocks.items()
            for key, text in faults
        ]
        conflicts += [*check_forces(self), *self._charge()]
        conflicts += [*check_gravity(self), *self._plane_gravity(), *self._heat(), *self._laws()]
        return [*super().faults(), *conflicts]

    def _charge(self) -> Faults:
        """Particles are no grains, and rigid bodies are not acted upon."""
        if self.charge is not None and self.charge.per_mass is None:
            yield "charge", "particles of a continuum are no grains; per_mass is allowed with them"
        if self.forces and self.sample.has_rigid:
            yield "forces", "they do not act on rigid bodies; use elastic ones, or gravity alone"

    def _heat(self) -> Faults:
        """All of the dust has a temperature, or none."""
        warm = [material.heat_capacity is not None for material in self.all_materials]
        if any(warm) != all(warm):
            without = self.material_names[warm.index(False)]
            path = "material" if without == DEFAULT else f"materials.{without}"
            yield f"{path}.heat_capacity", "another material has one; give it to all, or to none"

    def _laws(self) -> Faults:
        """Laws of all materials are compiled together."""
        laws = dust_laws.laws_of(self.all_materials)
        if conflict := dust_laws.describe_conflict(laws, CommonNumbers.names()):
            yield "materials", conflict

    def _plane_gravity(self) -> Faults:
        """Gravity that a continuum, or its plane, does not have."""
        gravity = self.gravity
        if gravity is None:
            return
        if gravity.central is not None:
            yield "gravity.central", "allowed with method: grains only; give an acceleration"
            return
        if self.dimension == 2 and (gravity.acceleration or (0.0, 0.0))[1]:
            yield "gravity.acceleration.1", "there is no y in plane strain; give 0 there"
        if gravity.self_gravity is None:
            return
        # images would be infinitely many
        if self.boundary.periodic_axes or getattr(self.boundary, "mirrors", ()):
            text = "images beyond periodic faces and mirrors do not attract; leave one of both out"
            yield "gravity.self_gravity", text
        if self.sample.has_rigid:
            text = "rigid bodies do not attract; use elastic ones, or leave it out"
            yield "gravity.self_gravity", text

    def _mirrors(self) -> Faults:
        """Images beyond a mirror stay where they are."""
        moves = any(plan.drive.wall_speed for plan in self.stage_plans)
        if "top" in self.boundary.mirrors and moves:
            yield "top", "a mirror does not move; allowed with wall_speed: rigid, or a layer"


def _has_dust(sample: Any) -> bool:
    """True where plain data of a sample have a body of dust, or are no sample."""
    if not isinstance(sample, dict):
        return True
    inner = [sample[key] for key in ("target", "projectile") if key in sample]
    inner += sample.get("bodies") or []
    if inner:
        return any(map(_has_dust, inner))
    return sample.get("kind", "rigid") not in ("elastic", "rigid")
